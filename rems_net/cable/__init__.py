"""Access to a robot over a USB cable: its console, Improv, and the bridge."""
