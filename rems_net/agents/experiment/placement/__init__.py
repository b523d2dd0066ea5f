"""Placement: the machines that bring agents of a run, and the files they get."""
