"""How robots are done: drivers only, one per file, without any definition."""
