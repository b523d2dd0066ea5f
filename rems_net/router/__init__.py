"""How values travel: keys, links, sessions. The only room that imports zenoh."""
