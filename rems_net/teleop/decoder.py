"""Decoder: key events from the bytes that a terminal sends.

Plain terminals send characters, and nothing when a key is released. Terminals with
kitty's keyboard protocol (kitty, foot, WezTerm, Ghostty, Alacritty and others) send
`CSI code;modifiers:event u`, with a release. Source: docs/keyboard-protocol.rst of
kitty.
"""

import re
from typing import NamedTuple

#: asks a terminal for its kind, which all answer
KIND = b"\x1b[c"
#: asks a terminal for its flags of the protocol, then for its kind
QUESTION = b"\x1b[?u" + KIND
#: Flags 1 (escape codes are unambiguous), 2 (report releases), 8 (letters as codes),
#: and reports when the window loses the focus.
BEGIN = b"\x1b[>11u\x1b[?1004h"
END = b"\x1b[?1004l\x1b[<u"

_ARROWS = {"A": "up", "B": "down", "C": "right", "D": "left"}
#: codes of keys without a letter
_CODES = {57441: "shift", 57447: "shift", 32: "space", 27: "escape", 13: "enter"}
_SEQUENCE = re.compile(rb"\x1b(?:\[([0-9;:?<>]*)([A-Za-z~])|O([A-Za-z]))")
_CTRL = 4
#: the answer to QUESTION of a terminal that knows the protocol
_KNOWS = re.compile(rb"\x1b\[\?\d+u")
#: the end of the answer to QUESTION
_ANSWERED = re.compile(rb"\x1b\[\?[0-9;]*c")


class KeyEvent(NamedTuple):
    """A key that was pressed, repeated because it is held down, or released.

    `""` is released if the focus is lost, and pressed if the terminal has answered.
    """

    key: str
    pressed: bool = True
    repeated: bool = False


class Decoder:
    """Turns bytes, in pieces of any size, into key events."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, piece: bytes) -> list[KeyEvent]:
        """Return the events of these bytes; keep an unfinished sequence for later.

        Raises KeyboardInterrupt for Ctrl+C, which is no signal in kitty's protocol.
        """
        events: list[KeyEvent] = []
        data = self._rest + piece
        self._rest = b""
        at = 0
        while at < len(data):
            if data[at] != 0x1B:
                events += _character(chr(data[at]))
                at += 1
                continue
            match = _SEQUENCE.match(data, at)
            if match is None:
                if len(data) - at < 32 and re.fullmatch(
                    rb"\x1b(\[[0-9;:?<>]*|O)?", data[at:]
                ):
                    self._rest = data[at:]
                    break
                at += 1
                continue
            events += _sequence(match)
            at = match.end()
        return events


def knows_releases(answer: bytes) -> bool:
    """Return whether a terminal that gives this answer reports releases."""
    return _KNOWS.search(answer) is not None


def has_answered(answer: bytes) -> bool:
    """Return whether the answer to QUESTION is complete."""
    return _ANSWERED.search(answer) is not None


def _character(one: str) -> list[KeyEvent]:
    if one == "\x03":
        raise KeyboardInterrupt
    named = {" ": "space", "\r": "enter", "\n": "enter"}.get(one, one.lower())
    return [KeyEvent(named)] if named.isprintable() else []


def _sequence(match: re.Match[bytes]) -> list[KeyEvent]:
    words, last, plain = match.groups()
    if plain is not None:
        key = _ARROWS.get(plain.decode())
        return [KeyEvent(key)] if key else []
    end = last.decode()
    if end == "c" and words.startswith(b"?"):  # the answer to KIND
        return [KeyEvent("")]
    if end in "IO" and not words:  # the focus: gained, lost
        return [KeyEvent("", False)] if end == "O" else []
    numbers = [part.split(b":") for part in words.split(b";")]
    modifiers = _number(numbers[1][0]) - 1 if len(numbers) > 1 else 0
    event = _number(numbers[1][1]) if len(numbers) > 1 and len(numbers[1]) > 1 else 1
    if end in _ARROWS:
        key = _ARROWS[end]
    elif end == "u":
        code = _number(numbers[0][0])
        key = _CODES.get(code) or (chr(code).lower() if 32 < code < 0x110000 else "")
        if key == "c" and modifiers & _CTRL and event != 3:
            raise KeyboardInterrupt
        if (modifiers & _CTRL and event != 3) or not key.isprintable():
            return []
    else:
        return []
    return [KeyEvent(key, event != 3, event == 2)] if key else []


def _number(text: bytes) -> int:
    return int(text) if text.isdigit() and len(text) < 8 else 1
