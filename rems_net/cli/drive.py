"""`rems drive ROBOT ...`: drive robots by the keys of this terminal."""

import argparse
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack

from rems_net.cli.options import add_at, warn
from rems_net.client import Fabric, join
from rems_net.client.driving import PERIOD, RENEWAL, Driving
from rems_net.defdict import DefDict
from rems_net.errors import ExperimentError, nearest
from rems_net.router.asking import meets
from rems_net.router.keys import agent_of, full_key
from rems_net.teleop.deadman import SILENT
from rems_net.teleop.keyboard import HOLD, Keyboard, open_keyboard
from rems_net.teleop.keys import KEYS, stick_of

EXAMPLES = """\
examples:
  rems drive robot/sim                 by arrow keys, or w a s d
  rems drive robot/sim robot/real      two robots, by the same keys
  rems drive 'robot/*'                 all robots
  rems drive input/stick               an input of type hand or keyboard

Up and down drive ahead and back, left and right turn, q and e go sideways;
with shift slower. At space robots stand still. Ctrl+C ends it, and every robot
stands. One person drives a robot; another who asks for it gets it after 5 s.
"""
#: s. Time between two looks at whether the robots are still there.
LOOK = 1.0
#: columns of the status line
WIDE = 78
GONE = (
    f"this terminal gave no sign for {SILENT:g} s while a key was held down: its line "
    "may be frozen, so robots stand. Let all keys go, and drive on"
)


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "keys", metavar="ROBOT", nargs="+", help="robot/sim, a glob, or input/stick"
    )
    add_at(parser)


def run(args: argparse.Namespace) -> int:
    """Drive until Ctrl+C, or until all robots are gone or taken."""
    for key in args.keys:
        full_key(key)  # Report a typo before looking for a fabric.
    with join(fabric=args.fabric, at=args.at) as fabric, ExitStack() as stack:
        found = _found(fabric, args.keys)
        hands = [stack.enter_context(Driving(fabric, key)) for key in found]
        with open_keyboard() as keyboard:
            Drive(fabric, hands, keyboard).go()
    return 0


def _found(fabric: Fabric, keys: list[str]) -> list[str]:
    """Return the agents with these keys, or whose keys match. Raises FabricError."""
    there = [row["agent"] for row in fabric.agents()]
    found: list[str] = []
    for key in keys:
        full = full_key(key, fabric.session.fabric)
        short = agent_of(full)
        if "*" in short:
            found += [a for a in there if meets(full, fabric.session.key(a))]
        elif short in there:
            found.append(short)
        else:
            robots = [a for a in there if a.startswith(("robot/", "input/"))]
            raise ExperimentError(
                f"There is no {short}.{nearest(short, robots)} Robots and inputs here: "
                f"{', '.join(robots) or 'none'}. Type: rems list (R0602)"
            )
    if not found:
        raise ExperimentError(f"No robot matches {keys[0]!r}. Type: rems list (R0602)")
    return list(dict.fromkeys(found))


class Drive:
    """Drives some robots by one keyboard, and shows it in one line."""

    def __init__(self, fabric: Fabric, hands: list[Driving], keyboard: Keyboard):
        self._fabric, self._hands, self._keyboard = fabric, hands, keyboard
        #: sentences that were shown, each once
        self._shown: set[str] = set()
        self._is_silent = False
        self._line = ""

    def go(self) -> None:
        """Drive until Ctrl+C, or until no robot is left."""
        print("\n".join(_first_lines(self._hands, self._keyboard)), flush=True)
        renewed = looked = time.monotonic()
        try:
            while self._hands:
                self._keyboard.wait(PERIOD)
                self._send()
                now = time.monotonic()
                if now > renewed + RENEWAL:
                    renewed = now
                    for hand in self._hands:
                        hand.keep()
                    self._report()
                if now > looked + LOOK:
                    looked = now
                    self._look()
        finally:
            self._clear()

    def _send(self) -> None:
        held = self._keyboard.held
        for key in self._keyboard.pressed:
            if key not in KEYS:
                self._say(f"{key!r} moves nothing; keys are {', '.join(KEYS)}")
        stick = stick_of(held)
        if any(stick.values()):
            for hand in self._hands:
                if hand.key.startswith("robot/"):
                    self._fabric.warn_if_stopped(hand.key)
        for hand in self._hands:
            hand.send(stick, held)
        if self._keyboard.silent and not self._is_silent:
            self._clear()
            warn(GONE)
        self._is_silent = self._keyboard.silent

    def _report(self) -> None:
        """Show who else wants a robot, and what the robots do."""
        for hand in [*self._hands]:
            if hand.taken:
                self._say(f"{hand.key} was taken by {hand.taken}")
                self._hands.remove(hand)
            elif (other := hand.other) is not None:
                if other.drives:
                    text = f"{other.name} drives {hand.key}; you get it in 5 s"
                else:
                    text = f"{other.name} asks for {hand.key}, and gets it in 5 s"
                self._say(text)
        if self._hands and sys.stdout.isatty():
            stick = stick_of(self._keyboard.held)
            parts = [f"{axis} {value:+4.0f} %" for axis, value in stick.items()]
            robots = [hand for hand in self._hands if hand.key.startswith("robot/")]
            parts += _state(robots[0].state()) if robots else []
            line = "  ".join(parts)[:WIDE].ljust(WIDE)
            if line != self._line:
                self._line = line
                print(f"\r{line}", end="", flush=True)

    def _look(self) -> None:
        """Leave out robots that are gone."""
        for hand in [*self._hands]:
            if not self._fabric.is_there(hand.key):
                self._say(f"{hand.key} has left")
                self._hands.remove(hand)

    def _say(self, sentence: str) -> None:
        if sentence not in self._shown:
            self._shown.add(sentence)
            self._clear()
            warn(sentence)

    def _clear(self) -> None:
        if self._line:
            print(f"\r{' ' * WIDE}\r", end="", flush=True)
            self._line = ""


def _first_lines(hands: list[Driving], keyboard: Keyboard) -> Iterator[str]:
    names = ", ".join(hand.key for hand in hands)
    how = "arrow keys or w a s d (q e sideways, shift slower); space stands still"
    yield f"{names}: {how}"
    if not keyboard.releases:
        yield (
            "This terminal does not report when a key is released: each key moves for "
            f"{HOLD:g} s."
        )
    yield "Ctrl+C ends it."


def _state(state: DefDict | None) -> list[str]:
    """Return the first numbers of a state, such as `x 0.125 m`."""
    if state is None:
        return []
    return [
        f"{path} {one['value']:.3f} {one['unit']}"
        for path, one in state.describe().items()
        if isinstance(one["value"], float)
    ][:3]
