"""What cameras see: how a world looks, and what draws it."""
