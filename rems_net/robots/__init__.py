"""What robots are: definitions only, one robot per file, without any driver."""
