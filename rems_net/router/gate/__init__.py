"""Access to a router: its users, and what each of them may do there."""
