"""Robots that are really driven: a device thread each, in wall time."""
