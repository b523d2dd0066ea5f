"""Processes that ship: each is found by its name, such as `process = "residual"`."""
