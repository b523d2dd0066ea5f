"""Interfaces: at which addresses other laptops can reach this one."""

import ipaddress
import re
import socket
from dataclasses import dataclass

import ifaddr

#: how adapters of VPNs are called: on Linux and macOS, and as Windows describes them
_VPN = (
    r"tun|tap|utun|wg|ppp|ipsec|tailscale|zt|TAP-|Wintun|WireGuard|OpenVPN|ZeroTier"
    r"|Cisco AnyConnect|PANGP|Fortinet|Juniper|NordLynx|Mullvad|ProtonVPN"
)
#: what no laptop of the class is behind, either: containers, virtual machines
_OTHER = (
    r"lo\d*$|docker|br-|veth|virbr|vmnet|vboxnet|vnet|lxc|lxd|cni|flannel|podman"
    r"|awdl|llw|anpi|bridge|gif|stf|vEthernet|VirtualBox|VMware|Hyper-V"
    r"|Software Loopback|Microsoft.*Loopback"
)
_TUNNEL = re.compile(_VPN, re.IGNORECASE)
_VIRTUAL = re.compile(f"{_VPN}|{_OTHER}", re.IGNORECASE)
#: an address of documentation (RFC 5737), which is never on the next network
_NOBODY = "198.51.100.1"


def tunnels() -> list[str]:
    """The VPNs of this machine that have an IPv4 address now."""
    return [
        adapter.nice_name
        for adapter in ifaddr.get_adapters()
        if _TUNNEL.match(adapter.nice_name) and any(ip.is_IPv4 for ip in adapter.ips)
    ]


@dataclass(frozen=True, slots=True)
class Place:
    """Where this machine is on a network: which adapter, and among which addresses."""

    adapter: str
    network: ipaddress.IPv4Network

    @property
    def tunnel(self) -> bool:
        """Whether a VPN brought it."""
        return bool(_TUNNEL.match(self.adapter))

    def __contains__(self, host: str) -> bool:
        try:
            return ipaddress.ip_address(host) in self.network
        except ValueError:  # a name
            return False


def place(address: str) -> Place | None:
    """Where one of this machine's IPv4 addresses is."""
    for adapter in ifaddr.get_adapters():
        for ip in adapter.ips:
            if ip.is_IPv4 and ip.ip == address:
                network = f"{address}/{ip.network_prefix}"
                return Place(adapter.nice_name, ipaddress.IPv4Network(network, False))
    return None


def reachable() -> list[str]:
    """The IPv4 addresses of this machine that others can reach, each once.

    First the one at which the way out of here begins, if there is a way. IPv6 is left
    out: on class networks it changes by the hour, and nobody can read it aloud.
    """
    found = []
    for adapter in ifaddr.get_adapters():
        names = (adapter.nice_name, str(adapter.name))
        if any(_VIRTUAL.match(name) for name in names):
            continue
        for ip in adapter.ips:
            if ip.is_IPv4 and isinstance(ip.ip, str):
                address = ipaddress.ip_address(ip.ip)
                if not address.is_loopback and not address.is_link_local:
                    found.append(ip.ip)
    out = source(_NOBODY)
    return sorted(dict.fromkeys(found), key=lambda one: one != out)


def source(host: str) -> str:
    """The IPv4 address at which the way from here to `host` begins; "" without a way.

    Nothing is sent: a datagram socket is only told where it would send.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as way:
        try:
            way.connect((host, 9))
        except (OSError, UnicodeError):  # the second is of a name that can be none
            return ""
        return str(way.getsockname()[0])
