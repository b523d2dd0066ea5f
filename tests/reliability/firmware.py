"""FirmwareScene: a Woodbot that runs its own firmware, driven on an open fabric.

The firmware's C code, as `rems board emulate woodbot` runs it; a router, and a clock
of `rems router serve`; a program outside of any run commands it at every tick.
"""

from tests.firmware.emulated.scene import DEAD_BAND
from tests.reliability.rig.rig import HERE
from tests.reliability.rows import Row
from tests.reliability.scene import Change, Scene

NAME = "woodbot-7"


def has(row: Row) -> bool:
    """Whether there is such a fault here: there is no run, and no host."""
    return row.commander in ("outside", "remote") or row.title.startswith(
        ("the clock", "the router")
    )


def _turns(pulse: int) -> bool:
    """Whether a servo turns at a pulse [us]: none, or one near the middle, stands."""
    return pulse > 0 and abs(pulse - 1500) > DEAD_BAND


class FirmwareScene(Scene):
    """A scene of another making; the same faults befall it."""

    def _build(self) -> None:
        rig = self.rig
        self.router, self.endpoint = rig.router(HERE)
        self.run = rig.rems("router", "serve", "--no-qr", router=self.endpoint)
        self.run.wait_for("^Open fabric", 60.0)
        where = ("--router", self.endpoint, "--servos", str(self._log))
        rig.module(
            "tests.firmware.emulated.process",
            *("--name", NAME, *where, "--control", "-"),
        )
        if self.commander == "remote":
            self.run.wait_for(f"^robot/{NAME} .* is here", 60.0)
            self._command_from_a_run(f"rems/robot/{NAME}")
        else:
            self.outsider = rig.module(
                "tests.firmware.posix.driver", self.endpoint, NAME
            )
        self.wait_until_moving(60.0)

    def changes(self) -> list[Change]:
        """All that its servos got, in order: when, and the pulses of both, in us."""
        if self._log.exists():
            for at, left, right in map(str.split, self._new_lines()):
                moves = any(_turns(int(pulse)) for pulse in (left, right))
                self._changes.append(Change(0, float(at), moves, "watchdog"))
        return self._changes
