"""The model of a receiver: what it reads at the right speed, and at a wrong one."""

import pytest

from tests.firmware.console.chromium.uart import received


@pytest.mark.parametrize("read", [112_000, 115_200, 118_000])
def test_at_nearly_the_same_speed(read: int) -> None:
    """A UART bears 3 %, as data sheets say: half a bit in ten."""
    assert list(received(bytes(range(256)), 115_200, read)) == list(range(256))


def test_at_an_eighth() -> None:
    """A byte of eight bits lasts a bit and a quarter: a start bit, then rest."""
    assert list(received(b"\x00", 921_600, 115_200)) == [0xFF]
    read = list(received(bytes(600), 921_600, 115_200))
    assert {"FramingError", "BreakError"} & set(map(str, read))


def test_at_eight_times() -> None:
    """A zero lasts eight bits and more: the line never comes back to rest."""
    assert list(received(b"\x00", 115_200, 921_600)) == ["BreakError"]
