"""Cameras at this computer."""
