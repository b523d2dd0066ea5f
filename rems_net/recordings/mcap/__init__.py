"""MCAP: a recording in one file that other programs open."""
