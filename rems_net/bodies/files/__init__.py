"""Robots that a file describes: what is in it, as a body."""
