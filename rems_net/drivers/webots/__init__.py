"""Robots in the Webots simulator, driven from outside of it."""
