"""The relay: each client of a shared router reaches Zenoh through it."""
