"""Robots: definitions only, one robot per file, without any driver."""
