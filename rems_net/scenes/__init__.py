"""Scenes: places and the things in them, and rays and outlines without an engine."""
