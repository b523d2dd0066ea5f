"""Verbs of boards: their ports, firmware, settings and emulators."""
