"""Search for a class's router: its address, its spoken code, and its storage."""
