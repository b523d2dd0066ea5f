"""Verbs of agents: start them on an open fabric, or bring them to a run."""
