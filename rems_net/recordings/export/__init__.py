"""Recordings as files and tables of other programs."""
