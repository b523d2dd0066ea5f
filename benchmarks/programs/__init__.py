"""One small program per contender; each prints one line of JSON."""
