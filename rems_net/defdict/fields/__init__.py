"""Layer 2. Fields: what one value must be, which values it takes, and its makers."""
