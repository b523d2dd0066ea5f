"""Checking: what can be known of an experiment before anything starts."""
