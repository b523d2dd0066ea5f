"""Parameters of robots that recordings have shown, in files."""
