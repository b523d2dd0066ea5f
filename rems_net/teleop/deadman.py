"""Deadman: the dead man's switch of a hand that may go silent while it drives."""

import time

#: s. A hand that is deflected and gives no sign for longer is at rest.
SILENT = 1.0


class Deadman:
    """Dead man's switch of one stick, or of the keys of one keyboard.

    A hand drives only after it has been at rest. It stops driving when it is deflected
    and gives no sign for SILENT s: a wireless gamepad that is out of range and a
    terminal whose line is frozen look like a stick that is held still.
    """

    def __init__(self) -> None:
        self._drives = self._deflected = False
        self._signed = time.monotonic()
        #: whether the hand was let go because it was silent, and not at rest since
        self.silent = False

    def sign(self, deflected: bool) -> None:
        """Take in a sign of the hand, and whether it is away from rest."""
        self._look()
        if not deflected:
            self._drives, self.silent = True, False
        self._signed, self._deflected = time.monotonic(), deflected

    @property
    def drives(self) -> bool:
        """Whether the hand counts now."""
        self._look()
        return self._drives

    @property
    def silence(self) -> float:
        """Seconds since the last sign of a hand that drives; 0 if it is at rest."""
        drives = self._drives and self._deflected
        return time.monotonic() - self._signed if drives else 0.0

    def _look(self) -> None:
        if self.silence > SILENT:
            self._drives, self.silent = False, True
