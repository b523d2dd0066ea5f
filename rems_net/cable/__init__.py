"""A robot at the other end of a USB cable: its console, Improv, and the bridge."""
