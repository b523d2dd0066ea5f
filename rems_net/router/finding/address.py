"""Addresses of routers, as people write, read aloud and type them.

`tcp/192.168.1.20:7447` is an endpoint; `192.168.1.20` and `lab-pc` stand for one, too.
A code is a short form of an IPv4 address: eight letters and digits, without those that
sound or look alike. The last one is a check digit.
"""

import ipaddress
import re
import socket
from contextlib import suppress

from rems_net.errors import FabricError

#: port at which routers listen
PORT = 7447
#: Crockford's base 32: no I, L, O or U
_DIGITS = "0123456789ABCDEFGHJKMNPQRSTVWXYZ"
_ALIKE = str.maketrans("ILO", "110")
_HOST = re.compile(r"\w([\w.-]{0,252}\w)?")
#: a prime: the check digit finds two swapped digits and one mistyped digit, except 0
#: for Z
_CHECK = 31


def to_endpoint(text: str) -> str:
    """Return the endpoint for an address, a name or a code.

    Raises FabricError for any other text.
    """
    given = text.strip()
    if found := from_code(given):
        return f"tcp/{found}:{PORT}"
    # Zenoh's own settings follow, such as `#iface=wlan0`.
    end = min((i for i in map(given.find, "#?") if i >= 0), default=len(given))
    given, settings = given[:end], given[end:]
    protocol, slash, rest = given.rpartition("/")
    protocol = protocol if slash else "tcp"
    # an IPv6 address without a port
    if rest.count(":") > 1 and not rest.startswith("["):
        rest = f"[{rest}]"
    host, port = rest, str(PORT)
    if match := re.fullmatch(r"(\[[^]]+\]|[^:]+):([0-9]{1,5})", rest):
        host, port = match.groups()
    if not protocol.isalnum() or not _is_host(host) or not 0 < int(port) < 65536:
        raise FabricError(
            f"{text!r} is no address of a router; expected what `rems router serve` "
            "prints, such as tcp/192.168.1.20, a name such as lab-pc, or a code such "
            f"as {to_code('192.168.1.20')}. (R0604)"
        )
    return f"{protocol}/{host}:{port}{settings}"


def _is_host(host: str) -> bool:
    if host.startswith("["):
        host = host[1:-1].partition("%")[0]
    # An address with a mistyped number is not a name.
    name = _HOST.fullmatch(host) and not re.fullmatch(r"[0-9.]+", host)
    return bool(name or address_of(host))


def to_code(address: str) -> str:
    """Return the code of an IPv4 address: `60M0-0581`."""
    number = int(ipaddress.IPv4Address(address))
    digits = "".join(_DIGITS[number >> shift & 31] for shift in range(30, -1, -5))
    code = digits + _DIGITS[_sum(digits)]
    return f"{code[:4]}-{code[4:]}"


def from_code(text: str) -> str:
    """Return the address for a code; "" if `text` is no code.

    Raises FabricError for a mistyped code.
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
        f"machine, type tcp/{text}. (R0604)"
    )


def _sum(digits: str) -> int:
    weighed = (i * _DIGITS.index(digit) for i, digit in enumerate(digits, 1))
    return sum(weighed) % _CHECK


def host_and_port(endpoint: str) -> tuple[str, int]:
    """Return `("192.168.1.20", 7447)` for an endpoint; the port is 0 if it has none."""
    host, _, port = re.split("[#?]", endpoint)[0].partition("/")[2].rpartition(":")
    return host.strip("[]"), int(port) if port.isdecimal() else 0


def located(endpoint: str) -> str:
    """Return the endpoint for Zenoh, which knows no adapter's name and no accents.

    `tcp/[fe80::1%wlan0]:7447` becomes `tcp/[fe80::1%3]:7447`, and a name with letters
    beyond ASCII its address, if it is known.
    """
    host, port = host_and_port(endpoint)
    if host.isascii() and "%" not in host:
        return endpoint
    with suppress(OSError, UnicodeError):
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
        address = found[0][4]
        plain = str(address[0]).partition("%")[0]
        if len(address) == 4:
            plain = f"[{plain}%{address[3]}]" if address[3] else f"[{plain}]"
        protocol, _, rest = endpoint.partition("/")
        settings = "".join(re.findall("[#?].*", rest)[:1])
        return f"{protocol}/{plain}:{port}{settings}"
    return endpoint


def address_of(host: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    """Return the address; None for a name."""
    try:
        return ipaddress.ip_address(host)
    except ValueError:
        return None


def is_ipv4(host: str) -> bool:
    """Return whether it is an IPv4 address, and not a name."""
    return isinstance(address_of(host), ipaddress.IPv4Address)


def is_here(endpoint: str) -> bool:
    """Return whether an endpoint is on this machine, judged by its text."""
    host, _ = host_and_port(endpoint)
    found = address_of(host)
    return found.is_loopback if found else host == "localhost"
