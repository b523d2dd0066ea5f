"""A running fabric from outside: robots as ordinary objects, values by their key."""

from rems_net.fabric.fabric import Fabric, join
from rems_net.fabric.proxy import LiveValue, Proxy
from rems_net.fabric.stopping import Receipt

__all__ = ["Fabric", "LiveValue", "Proxy", "Receipt", "join"]
