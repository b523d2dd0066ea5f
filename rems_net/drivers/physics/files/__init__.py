"""Robots from a URDF or MJCF, in each engine."""
