"""The time authority: ticks, who takes part, who is gone."""
