"""Layer 4. Wire: payloads, bounded, read with every check, and compiled."""
