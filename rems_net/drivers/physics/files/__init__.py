"""Robots that a file describes, in each engine."""
