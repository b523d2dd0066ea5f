"""Addresses: how a router is named by people, read aloud and typed once.

`tcp/192.168.1.20:7447` is an endpoint; `192.168.1.20` and `lab-pc` mean one, too. A
code is a shorter way to say an IPv4 address: eight letters and digits, without those
that sound or look alike, the last of which checks the others.
"""

import ipaddress
import re

from rems_net.errors import FabricError

#: where routers listen
PORT = 7447
#: Crockford's base 32: no I, L, O or U
_DIGITS = "0123456789ABCDEFGHJKMNPQRSTVWXYZ"
_ALIKE = str.maketrans("ILO", "110")
_HOST = re.compile(r"[A-Za-z0-9]([A-Za-z0-9.-]{0,252}[A-Za-z0-9])?")
#: a prime that two swapped or one mistyped digit can't get past
_CHECK = 31


def to_endpoint(text: str) -> str:
    """The endpoint that `text` means: an address, a name or a code.

    Raises FabricError for what is none.
    """
    given = text.strip()
    if found := from_code(given):
        return f"tcp/{found}:{PORT}"
    # What follows is Zenoh's own, such as `#iface=wlan0`.
    end = min((i for i in map(given.find, "#?") if i >= 0), default=len(given))
    given, settings = given[:end], given[end:]
    protocol, slash, rest = given.rpartition("/")
    protocol = protocol if slash else "tcp"
    if rest.count(":") > 1 and not rest.startswith("["):  # an IPv6 address, no port
        rest = f"[{rest}]"
    host, port = rest, str(PORT)
    if match := re.fullmatch(r"(\[[^]]+\]|[^:]+):([0-9]{1,5})", rest):
        host, port = match.groups()
    if not protocol.isalnum() or not _is_host(host) or not 0 < int(port) < 65536:
        raise FabricError(
            f"{text!r} is no address of a router; expected what `rems router serve` "
            "prints, such as tcp/192.168.1.20, a name such as lab-pc, or a code such "
            f"as {to_code('192.168.1.20')}."
        )
    return f"{protocol}/{host}:{port}{settings}"


def _is_host(host: str) -> bool:
    if host.startswith("["):
        host = host[1:-1].partition("%")[0]
    try:
        ipaddress.ip_address(host)
    except ValueError:
        # An address with a mistyped number is no name.
        return bool(_HOST.fullmatch(host)) and not re.fullmatch(r"[0-9.]+", host)
    return True


def to_code(address: str) -> str:
    """The code of an IPv4 address: `60M0-0581`."""
    number = int(ipaddress.IPv4Address(address))
    digits = "".join(_DIGITS[number >> shift & 31] for shift in range(30, -1, -5))
    code = digits + _DIGITS[_sum(digits)]
    return f"{code[:4]}-{code[4:]}"


def from_code(text: str) -> str:
    """The address that a code means; nothing where `text` is no code.

    Raises FabricError for one that was mistyped.
    """
    code = text.upper().translate(_ALIKE)
    if not re.fullmatch(r"[0-9A-Z]{4}[- ][0-9A-Z]{4}", code):
        return ""
    code = code.replace("-", "").replace(" ", "")
    number = 0
    if set(code) <= set(_DIGITS):
        for digit in code[:-1]:
            number = number << 5 | _DIGITS.index(digit)
        if _sum(code[:-1]) == _DIGITS.index(code[-1]) and number < 2**32:
            return str(ipaddress.IPv4Address(number))
    raise FabricError(
        f"{text!r} is no code of a router: a letter or digit of it must be wrong. "
        "Read it once more where `rems router serve` runs; if it is the name of a "
        f"machine, type tcp/{text}."
    )


def _sum(digits: str) -> int:
    weighed = (i * _DIGITS.index(digit) for i, digit in enumerate(digits, 1))
    return sum(weighed) % _CHECK


def host_and_port(endpoint: str) -> tuple[str, int]:
    """`("192.168.1.20", 7447)` of an endpoint; the port is 0 where there is none."""
    host, _, port = re.split("[#?]", endpoint)[0].partition("/")[2].rpartition(":")
    return host.strip("[]"), int(port) if port.isdecimal() else 0


def is_ipv4(host: str) -> bool:
    """Whether it is an IPv4 address, and no name."""
    try:
        return isinstance(ipaddress.ip_address(host), ipaddress.IPv4Address)
    except ValueError:
        return False


def is_here(endpoint: str) -> bool:
    """Whether an endpoint is on this machine by what it says."""
    host, _ = host_and_port(endpoint)
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
