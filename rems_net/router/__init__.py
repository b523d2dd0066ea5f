"""Transport of values: keys, links, sessions. The only room that imports zenoh."""
