"""Notices: what the gate refuses, in lines for the teacher's screen, never a flood."""

import threading
from collections.abc import Callable
from contextlib import suppress

#: s. Refusals of one kind and address are gathered so long, and are one line.
EVERY = 5.0
#: lines that wait at a time; further ones are counted
MOST = 20


class Notices:
    """Prints in a thread of its own: a terminal that is paused must hold up nobody."""

    def __init__(self, report: Callable[[str], None]):
        self._report = report
        self._told = threading.Condition()
        self._counts: dict[tuple[str, str], tuple[int, str]] = {}
        self._left_out = 0
        self._ended = False
        self._thread = threading.Thread(target=self._run, name="notices", daemon=True)

    def start(self) -> None:
        """Begin to print."""
        self._thread.start()

    def add(self, who: str, line: str, last: str = "") -> None:
        """Print `line`, in which {count} and {last} are filled in, for this address."""
        with self._told:
            key = (who, line)
            if key not in self._counts and len(self._counts) >= MOST:
                self._left_out += 1
                return
            self._counts[key] = (self._counts.get(key, (0, ""))[0] + 1, last)
            self._told.notify()

    def end(self) -> None:
        """Print what is left, and end; a terminal that is paused is not waited for."""
        with self._told:
            self._ended = True
            self._told.notify()
        self._thread.join(1.0)

    def _run(self) -> None:
        ended = False
        while not ended:
            with self._told:
                self._told.wait_for(lambda: self._counts or self._ended)
                # What comes within a moment is one line, from the first one on.
                self._told.wait_for(lambda: self._ended, 0.5)
                counts, self._counts = self._counts, {}
                left_out, self._left_out = self._left_out, 0
                ended = self._ended
            lines = [
                f"{who} {line.format(times=_times(count), last=last)}"
                for (who, line), (count, last) in counts.items()
            ]
            if left_out:
                lines.append(f"other addresses were refused {_times(left_out)}")
            if lines:
                with suppress(OSError, ValueError):  # the screen may be closed
                    self._report("\n".join(lines))
            with self._told:
                self._told.wait_for(lambda: self._ended, EVERY)
                ended = self._ended and not self._counts


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"
