"""One process in step with the clock: what came, ports, answers."""
