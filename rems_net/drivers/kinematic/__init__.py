"""Robots done by their definition's own mathematics."""
