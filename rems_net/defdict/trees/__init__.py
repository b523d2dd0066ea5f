"""Layer 3. Trees: fields with names and groups, frozen; pure data."""
