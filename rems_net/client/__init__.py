"""A running fabric from outside: robots as ordinary objects, values by their key."""

from rems_net.client.fabric import Fabric, join
from rems_net.client.proxy import LiveValue, Proxy
from rems_net.client.stopping import Receipt

__all__ = ["Fabric", "LiveValue", "Proxy", "Receipt", "join"]
