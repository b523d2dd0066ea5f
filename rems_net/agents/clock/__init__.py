"""The time authority: ticks, members, and lost members."""
