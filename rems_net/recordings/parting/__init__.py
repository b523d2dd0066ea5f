"""Where two robots of one run part, and why: computed from their recordings."""
