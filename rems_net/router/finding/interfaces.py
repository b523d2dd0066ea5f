"""Interfaces: addresses at which other laptops can reach this one."""

import ipaddress
import re
import socket
from dataclasses import dataclass

import ifaddr

from rems_net.router.finding.address import address_of

#: names of VPN adapters: on Linux and macOS, and as Windows describes them
_VPN = (
    r"tun|tap|utun|wg|ppp|ipsec|tailscale|zt|TAP-|Wintun|WireGuard|OpenVPN|ZeroTier"
    r"|Cisco AnyConnect|PANGP|Fortinet|Juniper|NordLynx|Mullvad|ProtonVPN"
)
#: adapters that lead to no laptop of the class: containers, virtual machines
_OTHER = (
    r"lo\d*$|docker|br-|veth|virbr|vmnet|vboxnet|vnet|lxc|lxd|cni|flannel|podman"
    r"|awdl|llw|anpi|bridge|gif|stf|vEthernet|VirtualBox|VMware|Hyper-V"
    r"|Software Loopback|Microsoft.*Loopback"
)
_TUNNEL = re.compile(_VPN, re.IGNORECASE)
_VIRTUAL = re.compile(f"{_VPN}|{_OTHER}", re.IGNORECASE)
#: an address for documentation (RFC 5737), never on the local network
_NOBODY = "198.51.100.1"


def tunnels() -> list[str]:
    """Return the VPNs of this machine that have an IPv4 address now."""
    return [
        adapter.nice_name
        for adapter in ifaddr.get_adapters()
        if _TUNNEL.match(adapter.nice_name) and any(ip.is_IPv4 for ip in adapter.ips)
    ]


@dataclass(frozen=True, slots=True)
class Place:
    """Place of this machine on a network: its adapter, and the range of addresses."""

    adapter: str
    network: ipaddress.IPv4Network

    @property
    def tunnel(self) -> bool:
        """Whether the adapter is a VPN's."""
        return bool(_TUNNEL.match(self.adapter))

    def __contains__(self, host: str) -> bool:
        found = address_of(host)
        return found is not None and found in self.network


def place(address: str) -> Place | None:
    """Return the adapter and network of one of this machine's IPv4 addresses."""
    for adapter in ifaddr.get_adapters():
        for ip in adapter.ips:
            if ip.is_IPv4 and ip.ip == address:
                network = f"{address}/{ip.network_prefix}"
                return Place(adapter.nice_name, ipaddress.IPv4Network(network, False))
    return None


def reachable() -> list[str]:
    """Return the IPv4 addresses of this machine that others can reach, each once.

    The address of the default route comes first, if there is one. IPv6 is left
    out: on class networks such an address changes every hour, and nobody can read it
        aloud.
    """
    return [address for address, kind in addresses() if not kind]


def addresses() -> list[tuple[str, str]]:
    """Return this machine's addresses with their kinds; "" for an ordinary one.

    The others are of a cable between two laptops (link-local), of a VPN, or of a
    bridge, which can be a phone's or a virtual machine's network, or IPv6. The address
    of the default route comes first.
    """
    found: dict[str, str] = {}
    for adapter in ifaddr.get_adapters():
        names = (adapter.nice_name, str(adapter.name))
        kind = ""
        if any(_TUNNEL.match(name) for name in names):
            kind = f"of the VPN {names[0]}"
        elif any(_VIRTUAL.match(name) for name in names):
            kind = f"of the bridge or virtual network {names[0]}"
        for ip in adapter.ips:
            text = str(ip.ip if ip.is_IPv4 else ip.ip[0]).partition("%")[0]
            address = ipaddress.ip_address(text)
            if address.is_loopback or (address.is_link_local and not ip.is_IPv4):
                continue
            local = f"link-local, of a cable at {names[0]} without a router"
            version = "" if ip.is_IPv4 else f"IPv6, of {names[0]}"
            found.setdefault(
                text, kind or (local if address.is_link_local else version)
            )
    out = source(_NOBODY)
    return sorted(found.items(), key=lambda one: (bool(one[1]), one[0] != out))


def source(host: str) -> str:
    """Return this machine's IPv4 address on the route to `host`; "" without a route.

    Nothing is sent: `connect` of a datagram socket only chooses the route.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as way:
        try:
            way.connect((host, 9))
        except (OSError, UnicodeError):  # UnicodeError: not a valid host name
            return ""
        return str(way.getsockname()[0])
