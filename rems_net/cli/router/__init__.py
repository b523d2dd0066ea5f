"""Verbs of routers: serve one, use one, forget it, and show its state."""
