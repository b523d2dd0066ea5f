"""The source of agents before it runs: its names, values, mistakes."""
