"""Checking: the mistakes in an experiment that can be found before anything starts."""
