"""Places, and what is in them: described, and looked at without any engine."""
