"""Layer 2. Fields: what one value must be, what is accepted, and who makes them."""
