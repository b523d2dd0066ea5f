"""Films of recordings in 3-D."""
