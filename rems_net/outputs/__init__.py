"""Outputs that ship."""
