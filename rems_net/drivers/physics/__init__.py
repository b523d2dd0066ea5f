"""Robots done by a physics engine."""
