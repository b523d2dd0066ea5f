"""Placement: which machine brings which agents of a run, and what it is given."""
