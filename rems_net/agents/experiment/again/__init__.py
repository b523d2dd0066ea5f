"""A recorded run is done again and compared, to the bit."""
