"""The values of many agents in one message: what is packed is read."""

from __future__ import annotations

import pytest
from hypothesis import given, strategies as st

from rems_net.agents.protocol.crowds import pack_crowd, read_crowd
from rems_net.errors import WireError
from rems_net.packing import pack

values = st.dictionaries(st.sampled_from("xyz"), st.floats() | st.booleans())
crowds = st.dictionaries(st.text(max_size=40), values.map(pack), min_size=1, max_size=6)


def packed(crowd: dict[str, bytes]) -> bytes:
    return pack_crowd([pack(name) + payload for name, payload in crowd.items()])


@given(crowds, crowds)
def test_each_gets_its_own_payload(
    before: dict[str, bytes], now: dict[str, bytes]
) -> None:
    """With the layout of another message or without."""
    _, layout = read_crowd(packed(before))
    for known in (None, layout):
        read, _ = read_crowd(packed(now), known)
        assert {name: read.payloads[at] for name, at in read.where.items()} == now


@given(crowds, values.map(pack))
def test_an_equal_layout_is_used_again(crowd: dict[str, bytes], payload: bytes) -> None:
    read, layout = read_crowd(packed(dict.fromkeys(crowd, payload)))
    again, same = read_crowd(packed(dict.fromkeys(crowd, payload)), layout)
    assert same is layout
    assert again.where is read.where


@pytest.mark.parametrize(
    ("message", "said"),
    [
        (pack({}), "expected the values of one or more agents"),
        (b"", "These 0 bytes are no values by name"),
        (pack([1, 2]), "are no values by name"),
        (pack_crowd([pack(7) + pack({})]), "a name is 7; expected text"),
        (pack_crowd([pack("a") + pack({})] * 2), "a name is 'a'; expected text, each"),
        (pack_crowd([pack("a") + pack({})]) + b"x", "there is something behind it"),
        (pack_crowd([pack("a") + pack("bcd")])[:-1], "These 6 bytes are no values"),
    ],
)
def test_what_is_no_crowd_is_refused(message: bytes, said: str) -> None:
    with pytest.raises(WireError, match=said):
        read_crowd(message)
