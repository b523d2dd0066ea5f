"""Finding a router of a class: where it is, said aloud once, and remembered."""
