"""File formats, and what is done with them: read, compared, drawn."""
