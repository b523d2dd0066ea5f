"""File formats of recordings: read, compared, drawn."""
