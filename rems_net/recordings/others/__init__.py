"""Recordings that other programs have written."""
