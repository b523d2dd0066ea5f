"""The page on recordings: reading at any time, and playing for each page."""
