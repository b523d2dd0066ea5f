"""Layer 1. Units: what each one measures, and maps between them; without fields."""
