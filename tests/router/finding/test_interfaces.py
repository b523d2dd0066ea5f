"""Interfaces: those at which other laptops can be, and no others."""

import ipaddress
import json
import shutil
import sys

import pytest

from rems_net.router.finding.interfaces import Place, reachable, source
from tests.commands import finished
from tests.reliability.rig.rig import ROOT, missing

#: makes devices with these names and addresses in a network namespace of its own, and
#: says what rems_net thinks of them
LOOK = """
import json, subprocess, sys
from rems_net.router.finding.interfaces import addresses, reachable, tunnels

def ip(*words):
    subprocess.run(["ip", *words], check=True)

for name, address in json.loads(sys.argv[1]).items():
    ip("tuntap", "add", "dev", name, "mode", "tap")
    ip("address", "add", address, "dev", name)
    ip("link", "set", name, "up")
if sys.argv[2]:
    ip("route", "add", "default", "dev", sys.argv[2])
print(json.dumps([reachable(), tunnels(), addresses()]))
"""


#: all addresses of the last machine, with their kinds
KINDS: list[list[str]] = []


def look(devices: dict[str, str], out: str = "") -> tuple[list[str], list[str]]:
    """What is reachable, and what is a VPN, on a machine with these devices."""
    done = finished(
        ["unshare", "--net", sys.executable, "-c", LOOK, json.dumps(devices), out], ROOT
    )
    assert done.returncode == 0, done.stderr
    addresses, vpns, KINDS[:] = json.loads(done.stdout)
    return addresses, vpns


def cannot() -> str:
    if reason := missing():
        return reason
    gone = [one for one in ("ip", "unshare") if shutil.which(one) is None]
    return f"there is no {gone[0]} (packages iproute2, util-linux)" if gone else ""


needs_devices = pytest.mark.skipif(bool(cannot()), reason=cannot())
CLASS = {"wlp3s0": "192.168.1.20/24", "enp0s31f6": "10.20.0.7/16"}
OTHERS = {
    "docker0": "172.17.0.1/16",
    "br-5f2a91c0": "172.18.0.1/16",
    "veth1a2b3c": "172.19.0.1/16",
    "virbr0": "192.168.122.1/24",
    "vboxnet0": "192.168.56.1/24",
    "podman0": "10.88.0.1/16",
}
VPN = {"tun0": "10.8.0.2/24", "wg0": "10.9.0.2/24", "tailscale0": "100.64.0.7/32"}


@pytest.mark.root
@needs_devices
def test_bridges_and_tunnels_are_left_out() -> None:
    addresses, vpns = look({**OTHERS, **CLASS, **VPN})
    assert sorted(addresses) == ["10.20.0.7", "192.168.1.20"]
    assert sorted(vpns) == sorted(VPN)


@pytest.mark.root
@needs_devices
@pytest.mark.parametrize(
    ("out", "first"), [("wlp3s0", "192.168.1.20"), ("enp0s31f6", "10.20.0.7")]
)
def test_the_way_out_is_first(out: str, first: str) -> None:
    addresses, _ = look(CLASS, out)
    assert addresses[0] == first
    assert len(addresses) == 2


@pytest.mark.root
@needs_devices
def test_nothing_is_reachable_on_no_network() -> None:
    assert look({"wlan0": "169.254.7.1/16"}) == ([], [])
    local = "link-local, of a cable at wlan0 without a router"
    assert ["169.254.7.1", local] in KINDS


@pytest.mark.root
@needs_devices
def test_an_unusual_address_has_its_kind() -> None:
    assert look({"bridge100": "192.168.2.1/24", "tun0": "10.8.0.2/24"})[0] == []
    bridge = "of the bridge or virtual network bridge100"
    assert ["192.168.2.1", bridge] in KINDS
    assert ["10.8.0.2", "of the VPN tun0"] in KINDS


@pytest.mark.parametrize(
    ("name", "vpn"),
    [  # as Windows and macOS call them
        ("PANGP Virtual Ethernet Adapter Secure", True),
        ("Cisco AnyConnect Secure Mobility Client Virtual Miniport Adapter", True),
        ("Fortinet SSL VPN Virtual Ethernet Adapter", True),
        ("ZeroTier Virtual Port", True),
        ("TAP-Windows Adapter V9", True),
        ("WireGuard Tunnel", True),
        ("utun3", True),
        ("Intel(R) Wi-Fi 6 AX201 160MHz", False),
        ("Microsoft Wi-Fi Direct Virtual Adapter #2", False),  # the mobile hotspot
        ("Realtek PCIe GbE Family Controller", False),
        ("Logitech USB Ethernet", False),
        ("en0", False),
    ],
)
def test_which_is_a_vpn(name: str, vpn: bool) -> None:
    assert Place(name, ipaddress.IPv4Network("10.0.0.0/8")).tunnel is vpn


def test_they_are_addresses_of_others() -> None:
    for address in reachable():
        assert not ipaddress.ip_address(address).is_loopback


def test_where_a_way_begins() -> None:
    assert source("127.0.0.1") == "127.0.0.1"
