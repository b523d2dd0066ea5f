"""iRobot Create 2, and Roombas of the 500 and 600 series, by their Open Interface."""
