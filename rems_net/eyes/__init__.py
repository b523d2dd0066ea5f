"""Eyes: markers in cameras' pictures, and the places of both."""
