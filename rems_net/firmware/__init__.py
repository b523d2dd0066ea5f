"""Firmware: the C code of a Woodbot, and what is made for it from its definition."""
