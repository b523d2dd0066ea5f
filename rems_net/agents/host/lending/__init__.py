"""How a robot of an open fabric is lent to another fabric, and comes back."""
