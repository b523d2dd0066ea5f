"""SimulatedScene: a robot without a device. It moves at the ticks that it obeys."""

import time

from tests.reliability.scene import Change, Scene

#: s. A simulated robot that got no tick for longer stands.
STILL = 0.15


class SimulatedScene(Scene):
    """A run whose driven robot is a model, which logs each tick."""

    #: the newest tick that it has logged: CLOCK_MONOTONIC, and whether it moved
    _last = 0.0, False

    def _devices(self) -> list[str]:
        return [""]

    def changes(self) -> list[Change]:
        """All changes so far: also of a robot that got no tick any more."""
        self._log = self.out / "moves.log"
        lines = self._new_lines() if self._log.exists() else []
        for words in map(str.split, lines):
            self._note(float(words[0]), words[1] == "True")
        at, moves = self._last
        if moves and time.monotonic() - at > STILL:
            self._add(at, False)
        return self._changes

    def _note(self, at: float, moves: bool) -> None:
        before, moved = self._last
        if moved and at - before > STILL:
            self._add(before, False)
        self._last = at, moves
        self._add(at, moves)

    def _add(self, at: float, moves: bool) -> None:
        last = self._changes[-1] if self._changes else None
        if moves != (last.moves if last else False):
            self._changes.append(Change(0, at, moves, "told"))
