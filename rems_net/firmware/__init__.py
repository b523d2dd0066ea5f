"""Firmware: the C code of a Woodbot, and the tables generated from its definition."""
