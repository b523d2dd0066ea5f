"""Inputs that ship."""
