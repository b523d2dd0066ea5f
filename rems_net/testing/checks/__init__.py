"""Checks of a robot, one idea in each file."""
