"""Addresses: what people type becomes an endpoint, or is told apart."""

import re
import socket

import pytest
from hypothesis import given, strategies as st

from rems_net.errors import FabricError
from rems_net.router.finding.address import (
    from_code,
    is_here,
    located,
    to_code,
    to_endpoint,
)

addresses = st.ip_addresses(v=4).map(str)


@given(addresses)
def test_a_code_means_its_address(address: str) -> None:
    code = to_code(address)
    assert from_code(code) == address
    spoken = code.lower().replace("0", "o").replace("1", "l").replace("-", " ")
    assert from_code(spoken) == address
    assert to_endpoint(code) == f"tcp/{address}:7447"


@given(
    addresses, st.integers(0, 7), st.sampled_from("0123456789ABCDEFGHJKMNPQRSTVWXYZ")
)
def test_one_mistyped_digit_is_found(address: str, at: int, digit: str) -> None:
    code = to_code(address)
    at += at > 3
    wrong = code[:at] + digit + code[at + 1 :]
    if wrong == code:
        return
    # the last digit, which checks, has 31 values of 32
    if at < 8 and (from_digit(digit) - from_digit(code[at])) % 31 == 0:
        return
    with pytest.raises(FabricError, match="is no code of a router"):
        from_code(wrong)


def from_digit(digit: str) -> int:
    return "0123456789ABCDEFGHJKMNPQRSTVWXYZ".index(digit)


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        ("tcp/192.168.1.20:7447", "tcp/192.168.1.20:7447"),
        ("tcp/192.168.1.20", "tcp/192.168.1.20:7447"),
        (" 192.168.1.20 ", "tcp/192.168.1.20:7447"),
        ("192.168.1.20:7500", "tcp/192.168.1.20:7500"),
        ("lab-pc", "tcp/lab-pc:7447"),
        ("lab-pc.local:80", "tcp/lab-pc.local:80"),
        ("udp/lab-pc", "udp/lab-pc:7447"),
        ("lab_pc", "tcp/lab_pc:7447"),
        ("müller-pc.local", "tcp/müller-pc.local:7447"),
        ("fe80::1", "tcp/[fe80::1]:7447"),
        ("[fe80::1%eth0]:7500", "tcp/[fe80::1%eth0]:7500"),
        ("lab-pc:7500#iface=eth0", "tcp/lab-pc:7500#iface=eth0"),
        ("30ag-08m6", "tcp/192.168.1.20:7447"),
    ],
)
def test_what_is_typed(typed: str, meant: str) -> None:
    assert to_endpoint(typed) == meant


@pytest.mark.parametrize(
    "typed",
    [
        "",
        "192.168.1.300",
        "1.2.3",
        "http://lab/",
        "a b",
        "tcp/",
        ":7447",
        "x:99999",
        "-x",
    ],
)
def test_what_is_none(typed: str) -> None:
    with pytest.raises(FabricError) as caught:
        to_endpoint(typed)
    assert str(caught.value) == (
        f"{typed!r} is no address of a router; expected what `rems router serve` "
        "prints, such as tcp/192.168.1.20, a name such as lab-pc, or a code such as "
        "30AG-08M6."
        " (R0604)"
    )


def test_a_mistyped_code_is_said() -> None:
    with pytest.raises(FabricError) as caught:
        to_endpoint("30AG-08M7")
    assert str(caught.value) == (
        "'30AG-08M7' is no code of a router: a letter or digit of it must be wrong. "
        "Read it once more where `rems router serve` runs; if it is the name of a "
        "machine, type tcp/30AG-08M7."
        " (R0604)"
    )


@pytest.mark.parametrize(
    ("endpoint", "here"),
    [
        ("tcp/127.0.0.1:7447", True),
        ("tcp/localhost:7447#so_sndbuf=1", True),
        ("tcp/[::1]:7447", True),
        ("tcp/192.168.1.20:7447", False),
        ("tcp/lab-pc:7447", False),
    ],
)
def test_here(endpoint: str, here: bool) -> None:
    assert is_here(endpoint) is here


@given(st.text(max_size=30))
def test_nothing_else_than_a_sentence(text: str) -> None:
    try:
        endpoint = to_endpoint(text)
    except FabricError:
        return
    port = re.search(r":([0-9]+)($|[#?])", endpoint)
    assert port
    assert 0 < int(port[1]) < 65536


def test_zenoh_gets_the_number_of_an_adapter() -> None:
    """It takes no name of one: `rems router use fe80::1%wlan0` found no router."""
    number, name = socket.if_nameindex()[0]
    there = located(f"tcp/[fe80::1%{name}]:7500#so_sndbuf=9")
    assert there == f"tcp/[fe80::1%{number}]:7500#so_sndbuf=9"
    for known in ("tcp/lab_pc:7447", "tcp/[fe80::1]:7447", "tcp/nobody-ü:7447"):
        assert located(known) == known
