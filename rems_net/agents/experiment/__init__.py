"""Agents and a clock: checked, planned, started, ended."""
