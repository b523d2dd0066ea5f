"""Who is let in by a router, and what he may do there."""
