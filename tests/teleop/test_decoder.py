"""Key events from a terminal's bytes, by kitty's keyboard protocol and without it."""

import pytest
from hypothesis import given, strategies as st

from rems_net.teleop.decoder import (
    Decoder,
    KeyEvent,
    has_answered,
    knows_releases,
)

#: bytes, by kitty's table of functional keys, and what they are
TABLE = [
    (b"\x1b[A", [KeyEvent("up")]),
    (b"\x1bOB", [KeyEvent("down")]),
    (b"\x1b[1;1:1C", [KeyEvent("right")]),
    (b"\x1b[1;1:2C", [KeyEvent("right", repeated=True)]),
    (b"\x1b[119;1:2u", [KeyEvent("w", repeated=True)]),
    (b"\x1b[1;1:3D", [KeyEvent("left", False)]),
    (b"\x1b[119u", [KeyEvent("w")]),
    (b"\x1b[119;1:3u", [KeyEvent("w", False)]),
    (b"\x1b[119;2:1u", [KeyEvent("w")]),
    (b"\x1b[57441;2:1u", [KeyEvent("shift")]),
    (b"\x1b[57447;1:3u", [KeyEvent("shift", False)]),
    (b"\x1b[32;1:1u", [KeyEvent("space")]),
    (b"\x1b[97:65;2:1u", [KeyEvent("a")]),
    (b"\x1b[119;129:1u", [KeyEvent("w")]),  # with num lock
    (b"\x1b[O", [KeyEvent("", False)]),  # the window lost the focus
    (b"\x1b[I", []),
    (b"w ", [KeyEvent("w"), KeyEvent("space")]),
    (b"W", [KeyEvent("w")]),
    (b"\x1b[97;5u", []),  # Ctrl+A
    (b"\x1b[97;5:3u", [KeyEvent("a", False)]),  # let go while Ctrl is held
    (b"\x1b[?62;22c", [KeyEvent("")]),  # the terminal's answer
    (b"\x1b[3~", []),
    (b"\x01\x02", []),
]


@pytest.mark.parametrize(("sent", "events"), TABLE)
def test_each_sequence(sent: bytes, events: list[KeyEvent]) -> None:
    assert Decoder().feed(sent) == events


@pytest.mark.parametrize("sent", [b"\x03", b"\x1b[99;5u", b"w\x1b[99;5:1u"])
def test_ctrl_c_works_in_all_of_them(sent: bytes) -> None:
    with pytest.raises(KeyboardInterrupt):
        Decoder().feed(sent)


def test_the_release_of_ctrl_c_is_no_ctrl_c() -> None:
    assert Decoder().feed(b"\x1b[99;5:3u") == [KeyEvent("c", False)]


@given(st.lists(st.sampled_from(TABLE)), st.data())
def test_pieces_of_any_size(
    rows: list[tuple[bytes, list[KeyEvent]]], data: st.DataObject
) -> None:
    sent = b"".join(one for one, _ in rows)
    decoder, found = Decoder(), []
    while sent:
        cut = data.draw(st.integers(1, len(sent)))
        found += decoder.feed(sent[:cut])
        sent = sent[cut:]
    assert found == [event for _, events in rows for event in events]


@given(st.binary(max_size=200))
def test_no_bytes_are_too_much(sent: bytes) -> None:
    decoder = Decoder()
    for byte in sent:
        try:
            events = decoder.feed(bytes([byte]))
        except KeyboardInterrupt:
            continue
        assert all(event.key.isprintable() for event in events)


def test_what_a_terminal_answers() -> None:
    assert knows_releases(b"\x1b[?0u\x1b[?62;22c")
    assert has_answered(b"\x1b[?0u\x1b[?62;22c")
    assert not knows_releases(b"\x1b[?62;22c")
    assert not has_answered(b"\x1b[?0u")
