"""Driver that computes robots by their definitions' own mathematics."""
