"""Devices without hardware: they speak their protocols, move, and misbehave."""
