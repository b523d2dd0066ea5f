"""What cameras see: markers, and where they lie."""
