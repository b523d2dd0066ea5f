"""WindowsConsole: key events of a Windows console, with releases.

Source: Microsoft's documentation of ReadConsoleInput and KEY_EVENT_RECORD.
"""

import ctypes
from collections.abc import Set
from ctypes import wintypes

from rems_net.teleop.decoder import KeyEvent

#: virtual key codes
_KEYS = {0x25: "left", 0x26: "up", 0x27: "right", 0x28: "down", 0x20: "space"}
_KEYS |= {0x10: "shift", 0x1B: "escape", 0x0D: "enter"}
_STD_INPUT_HANDLE = -10
_KEY_EVENT, _FOCUS_EVENT = 1, 16
_WAIT_OBJECT_0 = 0


class _KeyRecord(ctypes.Structure):
    _fields_ = (
        ("down", wintypes.BOOL),
        ("repeats", wintypes.WORD),
        ("code", wintypes.WORD),
        ("scan", wintypes.WORD),
        ("character", wintypes.WCHAR),
        ("modifiers", wintypes.DWORD),
    )


class _Event(ctypes.Union):
    _fields_ = (("key", _KeyRecord), ("focus", wintypes.BOOL))


class _Record(ctypes.Structure):
    _fields_ = (("kind", wintypes.WORD), ("event", _Event))


class WindowsConsole:
    """The console of this process. Ctrl+C stays a signal of Windows."""

    releases = True

    def __init__(self) -> None:
        self._system = vars(ctypes)["windll"].kernel32
        self._system.GetStdHandle.restype = wintypes.HANDLE
        self._in = wintypes.HANDLE(self._system.GetStdHandle(_STD_INPUT_HANDLE))
        self._is_down = vars(ctypes)["windll"].user32.GetAsyncKeyState
        self._is_down.restype = ctypes.c_short

    def read(self, seconds: float) -> list[KeyEvent]:
        """Return the events that came in this time, at the first that do."""
        milliseconds = max(int(seconds * 1000), 1)
        waited = self._system.WaitForSingleObject(self._in, milliseconds)
        if waited != _WAIT_OBJECT_0:
            return []
        records, count = (_Record * 64)(), wintypes.DWORD()
        self._system.ReadConsoleInputW(self._in, records, 64, ctypes.byref(count))
        events = (_event(one) for one in records[: count.value])
        return [event for event in events if event is not None]

    def ask(self, keys: Set[str]) -> bool:
        """Return whether Windows reports one of these keys as held down now."""
        codes = {name: code for code, name in _KEYS.items()}
        each = (codes.get(key) or ord(key.upper()[0]) for key in keys)
        return any(self._is_down(code) < 0 for code in each)

    def close(self) -> None:
        """Drop what was typed: the shell would read it."""
        self._system.FlushConsoleInputBuffer(self._in)


def _event(record: _Record) -> KeyEvent | None:
    if record.kind == _FOCUS_EVENT:
        return None if record.event.focus else KeyEvent("", False)
    if record.kind != _KEY_EVENT:
        return None
    key = record.event.key
    name = _KEYS.get(key.code) or str(key.character).lower()
    if not name or not name.isprintable():
        return None
    return KeyEvent(name, bool(key.down))
