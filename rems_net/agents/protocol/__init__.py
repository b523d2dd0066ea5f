"""What the clock and its hosts say to each other."""
