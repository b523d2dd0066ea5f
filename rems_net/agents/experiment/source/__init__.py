"""What the source of agents says before it runs: names, values, mistakes."""
