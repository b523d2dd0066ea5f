"""Layer 5. Values: live, with the behaviour of a dict whose keys are fixed."""
