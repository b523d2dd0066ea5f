"""What is looked at, one idea in each file."""
