"""What lives on the fabric: agents, their ports, the clock, hosts, experiments."""
