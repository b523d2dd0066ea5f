"""Engine: a tick as a plain function of agents, with no network and no wall clock."""
