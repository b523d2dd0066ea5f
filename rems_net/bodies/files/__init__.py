"""Reads robots from files, as bodies."""
