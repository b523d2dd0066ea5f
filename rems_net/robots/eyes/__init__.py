"""Robots that only see."""
