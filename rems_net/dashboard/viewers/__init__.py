"""Viewers: Lichtblick, Foxglove and PlotJuggler look at a fabric, and drive."""
