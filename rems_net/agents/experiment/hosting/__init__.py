"""Hosting: the processes of a run, and the thread beside its clock."""
