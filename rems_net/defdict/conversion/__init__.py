"""Layer 6. Conversion: how the values of one schema become those of another."""
