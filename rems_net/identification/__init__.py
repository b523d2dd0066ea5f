"""Identification: parameters of a robot from recordings of how it drove."""
