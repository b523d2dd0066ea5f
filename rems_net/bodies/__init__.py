"""Bodies and arenas: what robots and places are made of. Knows no engine."""
