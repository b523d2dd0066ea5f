"""The messages between the clock and its hosts."""
