"""Devices without hardware: what speaks their protocols, moves, and misbehaves."""
