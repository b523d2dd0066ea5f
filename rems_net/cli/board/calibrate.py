"""`rems board calibrate ROBOT`: measure a Woodbot's servos, and store the figures."""

import argparse
import math
import time
from collections.abc import Callable
from pathlib import Path
from statistics import fmean
from typing import Any

from rems_net.agents import parts
from rems_net.agents.robot import Definition
from rems_net.cli.options import add_at, console, plain_table, warn
from rems_net.client import Proxy, join
from rems_net.errors import AgentError, ExperimentError, FabricError, uncoded
from rems_net.firmware.calibration import Servo, fit

EXAMPLES = """\
examples:
  rems board calibrate woodbot-7
  rems board calibrate woodbot-7 --ruler     measure how far it went by hand

Put the robot on the floor, facing a wall that is 0.3 to 1 m away; the middle of
its arena will do. It turns about each wheel, then drives ahead and back, for
half a minute. Its gyroscope finds trim and dead band of each servo, its lidar
(or your ruler) their speed at 100 %. Nobody else may drive it meanwhile.
"""
SIDES = ("left", "right")
#: fractions of the top speed: near the dead band, and below saturation of the servos
LEVELS = (0.2, 0.35, 0.5)
#: s. Time until a servo reaches its commanded speed, and time of one measurement.
SETTLE, MEASURE = 0.4, 0.6
#: s. Time at rest for the gyroscope, and for the lidar.
REST, LOOK = 1.0, 1.5
#: s. Interval of commands; a robot stops 0.5 s after the last command.
PERIOD = 0.05
#: s. Longest wait until the robot stands.
STANDSTILL_TIMEOUT = 5.0
#: m, count. Distance of one drive, and how often it is driven there and back.
WAY, TIMES = 0.1, 2
NEAR, FAR = 0.2, 1.1
#: fraction. A larger difference of lidar and gyroscope causes a warning.
DOUBT = 0.2


def add(parser: argparse.ArgumentParser) -> None:
    """Add the options of `rems board calibrate`."""
    parser.add_argument("robot", metavar="ROBOT", help="such as woodbot-7")
    parser.add_argument(
        "--ruler", action="store_true", help="you measure how far it went"
    )
    add_at(parser)


def run(args: argparse.Namespace) -> int:
    """Measure, store, and print the result; if it fails, nothing changes."""
    name = args.robot.removeprefix("robot/")
    with join(fabric=args.fabric, at=args.at) as fabric:
        bench = Bench(name, fabric.robot(name))
        before = bench.servos()
        try:
            found = bench.calibrate(before, _ask if args.ruler else None)
        except BaseException:
            bench.restore(before)
            raise
    table = plain_table("", "trim", "dead band", "at 100 %")
    for side in SIDES:
        one = found[side]
        words = (f"{one.trim:+.0f} us", f"{one.dead_band:.0f} us")
        table.add_row(side, *words, f"{one.top_speed:.2f} rad/s")
    console(args).print(table)
    print(f"robot/{name} has stored it.")
    return 0


def _ask() -> float:
    """Return how far the robot went [m], measured by a person with a ruler."""
    try:
        said = input("It has driven ahead. How far [cm]? ").replace(",", ".")
    except EOFError:
        said = "nothing"
    try:
        went = float(said) / 100
    except ValueError:
        went = math.nan
    if not 0 < went < 10:
        raise ExperimentError(
            f"{said!r} is no distance; expected cm, such as 27.5. (R0712)"
        )
    return went


class Bench:
    """Calibration of one robot."""

    def __init__(self, name: str, robot: Proxy):
        self._name, self._robot = name, robot
        woodbot = parts.find("definition", "woodbot", Path())(name)
        assert isinstance(woodbot, Definition)  # `find` has checked it
        woodbot.prepare()
        self._parameters = woodbot.parameters

    # -- the whole -----------------------------------------------------------------

    def calibrate(
        self, before: dict[str, Servo], ask: Callable[[], float] | None
    ) -> dict[str, Servo]:
        """Measure the servos, and store the result.

        ask: returns how far the robot went [m]; None to use the lidar.
        """
        self._check(lidar=ask is None)
        bias = fmean(self._drive(0, 0, REST, "gyro/z"))
        found = {side: self._fit(side, before[side], bias) for side in SIDES}
        self._store(found)
        ratio = self._ratio(found) if ask is None else self._ruled(found, ask)
        if abs(ratio - 1) > DOUBT:
            warn(
                f"the way it went is {ratio:.2f} times that of its gyroscope: a wheel "
                "slips, or is of another size"
            )
        found = {side: one.scaled(ratio) for side, one in found.items()}
        self._store(found)
        return found

    def restore(self, servos: dict[str, Servo]) -> None:
        """Store the old values and stop the robot, if it still answers."""
        try:
            self._store(servos)
        except (AgentError, FabricError, ExperimentError) as error:
            warn(f"its servos may be half calibrated: {error}")

    def _fit(self, side: str, servo: Servo, bias: float) -> Servo:
        """Turn about the other wheel at several speeds, and fit the servo's figures."""
        p = self._parameters
        lever = p.track / p.wheel_radius * (-1 if side == "left" else 1)
        top = min(servo.top_speed, p.max_wheel_speed)
        told = [sign * level * top for level in LEVELS for sign in (1, -1)]
        found = []
        for speed in told:
            left, right = (speed, 0.0) if side == "left" else (0.0, speed)
            self._drive(left, right, SETTLE)
            rate = fmean(self._drive(left, right, MEASURE, "gyro/z")) - bias
            found.append(lever * rate)
        self._stand()
        try:
            return fit(servo, told, found)
        except ExperimentError as error:
            raise ExperimentError(f"The {side} wheel: {error}") from None

    # -- how far it goes ---------------------------------------------------------------

    def _ratio(self, servos: dict[str, Servo]) -> float:
        """Return the ratio of driven to estimated distance, measured by the lidar."""
        went = believed = 0.0
        for _ in range(TIMES):
            for sign in (1, -1):
                before = self._look()
                believed += self._go(servos, sign * WAY)
                went += sign * (before - self._look())
        return _divided(went, believed)

    def _ruled(self, servos: dict[str, Servo], ask: Callable[[], float]) -> float:
        """Return the same ratio by a ruler: one drive of twice the distance."""
        believed = self._go(servos, 2 * WAY)
        return _divided(ask(), believed)

    def _go(self, servos: dict[str, Servo], way: float) -> float:
        """Drive straight at 100 %; return the distance that the robot estimates [m]."""
        p = self._parameters
        top = min(p.max_wheel_speed, *(one.top_speed for one in servos.values()))
        before = self._robot.state.get()
        speed = math.copysign(top, way)
        self._drive(speed, speed, abs(way) / (p.wheel_radius * top))
        self._stand()
        after = self._robot.state.get()
        return math.hypot(after["x"] - before["x"], after["y"] - before["y"])

    def _look(self) -> float:
        """Return the distance of the wall ahead [m]."""
        seen = fmean(self._drive(0, 0, LOOK, "lidar/front"))
        if not NEAR <= seen <= FAR:
            raise ExperimentError(
                f"robot/{self._name} is {seen:.2f} m from what is ahead; put it 0.3 to "
                "1 m from a wall, facing it. Without a wall: --ruler (R0712)"
            )
        return seen

    # -- the robot -----------------------------------------------------------------

    def servos(self) -> dict[str, Servo]:
        """Return the stored values. Raises ExperimentError if it has no servos."""
        try:
            return _read(self._robot.servos())
        except AgentError as error:
            raise ExperimentError(
                f"robot/{self._name} has no servos to calibrate, only a Woodbot with "
                f"its own firmware has. ({uncoded(error)}) (R0712)"
            ) from None

    def _check(self, lidar: bool) -> None:
        figures = self._robot.figures()
        needed = {"gyro/z", "lidar/front"} if lidar else {"gyro/z"}
        for part in sorted(needed.intersection(figures["absent"])):
            hint = " Use --ruler" if part == "lidar/front" else " Look at its plug"
            raise ExperimentError(
                f"robot/{self._name} reports that {part} is absent.{hint} (R0712)"
            )
        if figures["safe"] == "stopped":
            raise ExperimentError("STOP holds. Type: rems stop --release (R0712)")

    def _store(self, servos: dict[str, Servo]) -> None:
        self._stand()
        words = {}
        for side, one in servos.items():
            words[f"{side}_trim"] = f"{one.trim:.1f}"
            words[f"{side}_dead_band"] = f"{one.dead_band:.1f}"
            words[f"{side}_top_speed"] = f"{one.top_speed:.3f}"
        self._robot.servos(**words)

    def _stand(self) -> None:
        """Stop the robot, and wait until nobody drives it."""
        if not self._robot.figures()["safe"]:
            self._robot.command = {"wheel/left": 0.0, "wheel/right": 0.0}
        until = time.monotonic() + STANDSTILL_TIMEOUT
        while not self._robot.figures()["safe"]:
            if time.monotonic() > until:
                raise ExperimentError(
                    f"Another program commands robot/{self._name}. Type: rems why "
                    f"robot/{self._name}/command (R0712)"
                )
            time.sleep(PERIOD)

    def _drive(
        self, left: float, right: float, seconds: float, part: str = "state"
    ) -> list[float]:
        """Drive for some seconds; return the values of a sensor meanwhile."""
        said = []
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            if left or right:
                self._robot.command = {"wheel/left": left, "wheel/right": right}
            if part != "state":
                said.append(float(self._robot.sensors.get()[part]))
            time.sleep(PERIOD)
        return said


def _divided(went: float, believed: float) -> float:
    if believed <= 0 or not 0.2 < went / believed < 5:
        raise ExperimentError(
            f"It went {100 * went:.0f} cm, and should have gone {100 * believed:.0f}: "
            "did it run into something, or was it lifted? (R0712)"
        )
    return went / believed


def _read(told: Any) -> dict[str, Servo]:
    return {
        side: Servo(
            float(told[f"{side}_trim"]),
            float(told[f"{side}_dead_band"]),
            float(told[f"{side}_top_speed"]),
            told[f"{side}_reversed"] == "yes",
        )
        for side in SIDES
    }
