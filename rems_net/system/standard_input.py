"""Standard input, read without a hold on its handle.

While a read of a pipe waits, Windows lets nobody else look at that pipe. NumPy's
libraries look at all standard handles while they load, so `import numpy` would wait for
ever (https://github.com/numpy/numpy/issues/24290). So on Windows nothing is read before
it is there.

The module imports next to nothing: a host reads its input before all else.
"""

import os
import sys
import time
from collections.abc import Iterator

#: s. Pause between two looks at a pipe or a console of Windows, and before another read
#: of a terminal in whose background we run.
LOOK, AGAIN = 0.02, 0.5
#: bytes that are read at once; bytes of a line, since a longer one is no command
CHUNK, LINE = 65536, 1024


def read(count: int) -> bytes:
    """Return at most `count` bytes of the standard input, b"" at its end.

    On Windows a console gives at least one line. Raises OSError.
    """
    if sys.platform == "win32":
        return _read_on_windows(count)
    # Not sys.stdin: at exit a thread that waits would still hold its lock, and its
    # buffer would swallow the following bytes.
    return os.read(0, count)


def lines(longest: int = LINE) -> Iterator[str]:
    """Yield the lines of the standard input, stripped, until its end.

    longest: bytes. Of a longer line only the end is kept.
    """
    kept = b""
    while True:
        try:
            portion = read(CHUNK)
        except OSError:  # we are in the background of a terminal, or it was closed
            if not os.isatty(0):
                return
            time.sleep(AGAIN)
            continue
        if not portion:
            return
        *whole, kept = (kept + portion).split(b"\n")
        kept = kept[-longest:]
        yield from (line.decode(errors="replace").strip() for line in whole)


if sys.platform == "win32":
    import _winapi
    import msvcrt

    def _read_on_windows(count: int) -> bytes:
        while not os.isatty(0):
            try:
                waiting, _ = _winapi.PeekNamedPipe(msvcrt.get_osfhandle(0), 0)
            except BrokenPipeError:
                return b""
            except OSError:  # a file: no read of it waits
                return os.read(0, count)
            if waiting:
                return os.read(0, min(count, waiting))
            time.sleep(LOOK)
        return _typed_line().encode()

    def _typed_line() -> str:
        """Return a line typed in the console; Ctrl+C stays a signal."""
        line = ""
        while not line.endswith("\n"):
            # Wine's console reads its terminal only for a program that waits for it.
            _winapi.WaitForSingleObject(msvcrt.get_osfhandle(0), 0)
            if not msvcrt.kbhit():
                time.sleep(LOOK)
                continue
            key = msvcrt.getwch()
            if key in "\x00\xe0":  # an arrow, or another key without a letter
                msvcrt.getwch()
            elif key == "\b":
                if line:
                    line = line[:-1]
                    _show("\b \b")
            else:
                key = "\n" if key == "\r" else key
                line += key
                _show(key)
        return line

    def _show(text: str) -> None:
        for character in text:
            msvcrt.putwch(character)
