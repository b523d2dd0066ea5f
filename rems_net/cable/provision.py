"""Provision: configure a robot's name, its fabric, its router and its Wi-Fi."""

from collections.abc import Callable
from dataclasses import dataclass, field

from rems_net.cable.console import Console, RefusedError
from rems_net.errors import FabricError, uncoded
from rems_net.router.finding.address import host_and_port, is_here, to_endpoint

#: The router address for a robot whose network is the cable itself.
CABLE = "cable"
#: Settings for routers, which the robot tries one after the other.
ROUTERS = ("router", "router2", "router3")
#: Bytes. Longest name of a network, and longest password.
LONGEST_SSID, LONGEST_PASSWORD = 32, 64


@dataclass(frozen=True)
class Wishes:
    """Settings for a robot; those that are None stay as they are."""

    name: str | None = None
    fabric: str | None = None
    source: str | None = None
    routers: tuple[str, ...] | None = None
    ssid: str | None = None
    user: str | None = None
    password: str = field(default="", repr=False)


def for_a_robot(address: str) -> str:
    """Return a router's address for a robot: `tcp/192.168.1.20:7447`, or `cable`.

    Raises FabricError for an address that a robot could not reach.
    """
    if address in ("", CABLE):
        return address
    endpoint = to_endpoint(address).partition("#")[0].partition("?")[0]
    if is_here(endpoint):
        raise FabricError(
            f"{endpoint} means this laptop only on this laptop; a robot needs an "
            "address that `rems router serve` prints, such as --router "
            "tcp/192.168.1.20. Over the USB cable: --router cable, then `rems board "
            "bridge`. (R0706)"
        )
    if not endpoint.startswith("tcp/") or not host_and_port(endpoint)[1]:
        raise FabricError(f"a robot speaks plain tcp only; got {endpoint}. (R0706)")
    return endpoint


def check(wishes: Wishes) -> None:
    """Check the settings before any is sent. Raises FabricError for a wrong one."""
    if len(wishes.routers or ()) > len(ROUTERS):
        raise FabricError(f"a robot remembers {len(ROUTERS)} routers at most. (R0706)")
    if wishes.user and wishes.ssid is None:
        raise FabricError("--user is of a network: write --ssid, too. (R0706)")
    if wishes.ssid is None:
        return
    if not 0 < len(wishes.ssid.encode()) <= LONGEST_SSID:
        raise FabricError(f"a network's name has 1 to {LONGEST_SSID} bytes. (R0706)")
    length = len(wishes.password.encode())
    if length > LONGEST_PASSWORD:
        raise FabricError(f"a password has {LONGEST_PASSWORD} bytes at most. (R0706)")
    if not wishes.user and 0 < length < 8:
        raise FabricError(
            "a password of a Wi-Fi network has at least 8 characters; leave it empty "
            "for an open network, and write --user for one such as eduroam. (R0706)"
        )


def provision(console: Console, wishes: Wishes, tell: Callable[[str], None]) -> None:
    """Set what `wishes` has, the network last.

    tell: called after each step. Raises FabricError with the reason if the robot or the
    network refuses.
    """
    routers = wishes.routers
    if routers is not None:
        padded = [*routers, *("" for _ in ROUTERS)]
        for which, address in zip(ROUTERS, padded, strict=False):
            console.set(which, address)
        tell(f"router: {', '.join(routers) or 'it looks for one by itself'}")
    for what in ("fabric", "source", "name"):
        value = getattr(wishes, what)
        if value is not None:
            console.set(what, value)
            tell(f"{what}: {value or 'anybody'}")
    if wishes.ssid is not None:
        console.set("user", wishes.user or "")
        _join(console, wishes.ssid, wishes.password, tell)


def _join(
    console: Console, ssid: str, password: str, tell: Callable[[str], None]
) -> None:
    tell(f"wifi: trying {ssid} ...")
    try:
        said = console.join(ssid, password)
    except RefusedError as error:
        raise FabricError(f"{uncoded(error)}. {_seen(console, ssid)} (R0706)") from None
    tell(f"wifi: {said or 'joined'}")


def _seen(console: Console, ssid: str) -> str:
    """Return a hint after a network refused the robot; "" if a scan fails."""
    try:
        found = console.scan()
    except (FabricError, TimeoutError):
        return ""
    names = [name for name, _, _ in found]
    if ssid in names:
        return "The robot sees it; its settings are as they were. Try again."
    seen = ", ".join(names[:8]) or "no network at all"
    return f"The robot sees: {seen}. It sees 2.4 GHz only, as every ESP32."
