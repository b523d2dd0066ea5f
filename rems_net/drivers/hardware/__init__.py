"""Drivers of real robots: a device thread each, in wall time."""
