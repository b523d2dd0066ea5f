"""Provision: tell a robot who it is, and where it belongs."""

from collections.abc import Callable
from dataclasses import dataclass, field

from rems_net.cable.console import Console, RefusedError
from rems_net.errors import FabricError
from rems_net.router.finding.address import host_and_port, is_here, to_endpoint

#: as a router: the cable itself is the network
CABLE = "cable"
#: routers that the robot tries, one after the other
ROUTERS = ("router", "router2", "router3")
#: bytes of the longest name of a network, and of its password
LONGEST_SSID, LONGEST_PASSWORD = 32, 64


@dataclass(frozen=True)
class Wishes:
    """What a robot is to become; what is None stays as it is."""

    name: str | None = None
    fabric: str | None = None
    source: str | None = None
    routers: tuple[str, ...] | None = None
    ssid: str | None = None
    user: str | None = None
    password: str = field(default="", repr=False)


def for_a_robot(address: str) -> str:
    """A router's address as a robot takes it: `tcp/192.168.1.20:7447`, or `cable`.

    Raises FabricError for one that it could not reach.
    """
    if address in ("", CABLE):
        return address
    endpoint = to_endpoint(address).partition("#")[0].partition("?")[0]
    if is_here(endpoint):
        raise FabricError(
            f"{endpoint} means this laptop only on this laptop; a robot needs an "
            "address that `rems router serve` prints, such as --router "
            "tcp/192.168.1.20. Over the USB cable: --router cable, then `rems board "
            "bridge`."
        )
    if not endpoint.startswith("tcp/") or not host_and_port(endpoint)[1]:
        raise FabricError(f"a robot speaks plain tcp only; got {endpoint}.")
    return endpoint


def check(wishes: Wishes) -> None:
    """Find what no robot would take, before one is asked. Raises FabricError."""
    if len(wishes.routers or ()) > len(ROUTERS):
        raise FabricError(f"a robot remembers {len(ROUTERS)} routers at most.")
    if wishes.user and wishes.ssid is None:
        raise FabricError("--user is of a network: say --ssid too.")
    if wishes.ssid is None:
        return
    if not 0 < len(wishes.ssid.encode()) <= LONGEST_SSID:
        raise FabricError(f"a network's name has 1 to {LONGEST_SSID} bytes.")
    length = len(wishes.password.encode())
    if length > LONGEST_PASSWORD:
        raise FabricError(f"a password has {LONGEST_PASSWORD} bytes at most.")
    if not wishes.user and 0 < length < 8:
        raise FabricError(
            "a password of a Wi-Fi network has at least 8 characters; leave it empty "
            "for an open network, and say --user for one such as eduroam."
        )


def provision(console: Console, wishes: Wishes, tell: Callable[[str], None]) -> None:
    """Set what is wished for, the network last.

    tell: called with each thing that is done. Raises FabricError with what the robot,
    or the network, says against it.
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
        raise FabricError(f"{error}. {_seen(console, ssid)}".rstrip()) from None
    tell(f"wifi: {said or 'joined'}")


def _seen(console: Console, ssid: str) -> str:
    """What helps where a network did not let the robot in."""
    try:
        found = console.scan()
    except (FabricError, TimeoutError):
        return ""
    names = [name for name, _, _ in found]
    if ssid in names:
        return "The robot sees it; its settings are as they were. Try again."
    seen = ", ".join(names[:8]) or "no network at all"
    return f"The robot sees: {seen}. It sees 2.4 GHz only, as every ESP32."
