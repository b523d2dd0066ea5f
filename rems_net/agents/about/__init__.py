"""Facts about an agent, for its run and for other programs."""
