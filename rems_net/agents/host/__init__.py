"""One process in step with the clock: received values, ports, answers."""
