"""Teleoperation: sticks and keys that people move, and how they become commands."""
