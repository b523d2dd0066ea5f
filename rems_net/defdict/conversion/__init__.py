"""Layer 6. Conversion: turns values of one schema into values of another."""
