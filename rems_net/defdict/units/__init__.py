"""Layer 1. Units: what one measures, and the maps between them; know no field."""
