"""Driver of robots in the Webots simulator, as their external controller."""
