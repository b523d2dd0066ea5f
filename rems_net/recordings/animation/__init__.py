"""Recordings as moving pictures."""
