"""Sweeps: one experiment, run many times with other settings, into one table."""
