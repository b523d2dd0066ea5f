"""Bytes that are heard at another speed than they were sent at."""

import pytest
from hypothesis import given, strategies as st

from rems_net.emulators.faults import resampled


@given(st.binary(max_size=40), st.sampled_from([300, 57_600, 115_200]))
def test_at_its_own_speed_it_is_the_same(portion: bytes, baud: int) -> None:
    assert resampled(portion, baud, baud) == portion
    # A receiver that is some percent off hears each byte, if not those behind it.
    assert resampled(portion[:1], baud, round(baud * 1.03)) == portion[:1]


@pytest.mark.parametrize(
    ("sent", "heard", "portion", "arrives"),
    [
        # Each bit is two of the receiver's: 0, 0 1 1 0 0 0 0 0, and no fall after that.
        (300, 600, b"\x81", b"\x06"),
        # A start bit lasts for longer than a whole byte: zeros, one for each fall.
        (300, 115_200, b"\x55", bytes(5)),
        # Many bytes are less than one bit.
        (115_200, 300, bytes(36), b"\xff"),
    ],
)
def test_at_another(sent: int, heard: int, portion: bytes, arrives: bytes) -> None:
    assert resampled(portion, sent, heard) == arrives
