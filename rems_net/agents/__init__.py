"""Agents on the fabric: their ports, the clock, hosts, experiments."""
