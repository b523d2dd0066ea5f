"""Notices: lines for the teacher's screen, never a flood: refusals, newcomers, STOP."""

import threading
import time
from collections.abc import Callable
from contextlib import suppress

#: s. Refusals of one kind and address within this time are one line.
EVERY = 5.0
#: s. Least time between two prints of urgent lines.
SOON = 1.0
#: lines that wait at a time; further ones are counted
MOST = 20
#: urgent lines that wait at a time: a class joins within a second
MOST_SOON = 200


class Notices:
    """Printer with its own thread: a paused terminal must not block anything."""

    def __init__(self, report: Callable[[str], None]):
        self._report = report
        self._told = threading.Condition()
        self._counts: dict[tuple[str, str], tuple[int, str]] = {}
        self._soon: dict[tuple[str, str], tuple[int, str]] = {}
        self._left_out = 0
        self._ended = False
        self._thread = threading.Thread(target=self._run, name="notices", daemon=True)

    def start(self) -> None:
        """Begin to print."""
        self._thread.start()

    def add(self, who: str, line: str, last: str = "", *, soon: bool = False) -> None:
        """Print `line`, in which {times} and {last} are filled in, for this address.

        soon: within SOON, and not with the refusals of the last EVERY seconds.
        """
        with self._told:
            key = (who, line)
            counts, most = (self._soon, MOST_SOON) if soon else (self._counts, MOST)
            if key not in counts and len(counts) >= most:
                self._left_out += 1
                return
            counts[key] = (counts.get(key, (0, ""))[0] + 1, last)
            self._told.notify()

    def end(self) -> None:
        """Print the rest, and end, without waiting for a paused terminal."""
        with self._told:
            self._ended = True
            self._told.notify()
        self._thread.join(1.0)

    def _run(self) -> None:
        ended, due = False, 0.0
        while not ended:
            with self._told:
                self._told.wait_for(lambda: self._counts or self._soon or self._ended)
                # Refusals within this time of the first one are one line.
                moment = max(0.5, due - time.monotonic())
                self._told.wait_for(lambda: self._soon or self._ended, moment)
                counts, self._soon = self._soon, {}
                left_out, ended = 0, self._ended
                if time.monotonic() >= due or ended:
                    due = time.monotonic() + EVERY if self._counts else due
                    counts, self._counts = counts | self._counts, {}
                    left_out, self._left_out = self._left_out, 0
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
                self._told.wait_for(lambda: self._ended, SOON)
                ended = self._ended and not (self._counts or self._soon)


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"
