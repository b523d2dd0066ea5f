"""Drivers that run robots in a physics engine."""
