"""`rems board calibrate ROBOT`: measure a Woodbot's servos, and store the figures."""

import argparse
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from statistics import stdev
from typing import NamedTuple

from rems_net.cli.board.bench import SIDES, Bench, mean
from rems_net.cli.options import add_at, console, plain_table, warn
from rems_net.client import join
from rems_net.errors import AgentError, ExperimentError, FabricError
from rems_net.firmware.calibration import Servo, fit
from rems_net.identification.intervals import student

EXAMPLES = """\
examples:
  rems board calibrate woodbot-7
  rems board calibrate woodbot-7 --ruler     measure how far it went by hand

Put the robot on the floor, facing a wall that is 0.4 to 1 m away; the middle of
its arena will do. It turns about each wheel, then drives ahead and back, for a
minute. Its gyroscope finds trim and dead band of each servo, its lidar (or your
ruler) their speed at 100 % and the track. A last drive, which none of this has
used, shows whether it goes where it should. runs/calibrate-ROBOT keeps all.
Nobody else may drive it meanwhile.
"""
#: fractions of the top speed: near the dead band, and below saturation of the servos
LEVELS = (0.2, 0.35, 0.5)
#: s. Time until a servo reaches its commanded speed, and time of one measurement.
SETTLE, MEASURE = 0.4, 0.6
#: s. Time at rest for the gyroscope, and for the lidar.
REST, LOOK = 1.0, 2.0
#: m, count. Distance of one drive, and how often it is driven there and back.
WAY, TIMES = 0.15, 3
#: m. Error of a distance that a person measures with a ruler.
RULER = 0.002
#: fraction. A larger difference of lidar and gyroscope causes a warning.
DOUBT = 0.2
#: fraction of the top speed, and rad: the last drive, at a speed that was not used.
LAST, CIRCLE = 0.6, 2 * math.pi
#: fractions. Errors of distance and of angle with which a robot goes where it should.
#: A lidar's noise makes an error of 2 % of 15 cm.
GOOD_WAY, GOOD_TURN = 0.07, 0.04
NOT_GOOD = (
    "It does not go where it should: look for a wheel that slips, charge the "
    "battery, and calibrate again."
)

#: Returns how far the robot went [m], measured by a person.
Ask = Callable[[], float]


class Last(NamedTuple):
    """A drive that was not used: m and rad that it went, and should have gone."""

    went: float
    way: float
    turned: float
    angle: float

    @property
    def good(self) -> bool:
        """Whether the robot went where it should."""
        off = abs(self.went / self.way - 1), abs(self.turned / self.angle - 1)
        return off[0] <= GOOD_WAY and off[1] <= GOOD_TURN

    def __str__(self) -> str:
        degrees = round(math.degrees(self.turned)), round(math.degrees(self.angle))
        return (
            f"A last drive, which was not used: it went {100 * self.went:.1f} cm of "
            f"{100 * self.way:.1f}, and turned {degrees[0]} degrees of {degrees[1]}."
        )


class Calibration(NamedTuple):
    """Servos and track [m], each with half the width of its 95 % interval."""

    servos: dict[str, Servo]
    half: dict[str, Servo]
    track: float
    track_half: float
    last: Last


def add(parser: argparse.ArgumentParser) -> None:
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
        with bench.recording(Path("runs") / f"calibrate-{name}") as path:
            try:
                found = calibrate(bench, before, _ask if args.ruler else None)
            except BaseException:
                _restore(bench, before)
                raise
    out = console(args)
    table = plain_table("", "trim", "dead band", "at 100 %")
    for side, one in found.servos.items():
        half = found.half[side]
        words = (
            f"{one.trim:+.0f} ± {half.trim:.1f} us",
            f"{one.dead_band:.0f} ± {half.dead_band:.1f} us",
            f"{one.top_speed:.2f} ± {half.top_speed:.2f} rad/s",
        )
        table.add_row(side, *words)
    out.print(table)
    assumed = 1000 * bench.parameters.track
    track, half_track = 1000 * found.track, 1000 * found.track_half
    lines = [
        f"track: {track:.1f} ± {half_track:.1f} mm, where its definition has "
        f"{assumed:.1f} mm. For a model:",
        f'  parameters = {{ track = "{track:.1f} mm" }}',
        str(found.last),
        "It goes where it should." if found.last.good else NOT_GOOD,
        f"robot/{name} has stored it. The recording is {path.as_posix()}",
    ]
    for line in lines:
        out.print(line)
    return 0


def _ask() -> float:
    try:
        said = input("It has driven. How far [cm]? ").replace(",", ".")
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


def _restore(bench: Bench, servos: dict[str, Servo]) -> None:
    """Store the old values and stop the robot, if it still answers."""
    try:
        bench.store(servos)
    except (AgentError, FabricError, ExperimentError) as error:
        warn(f"its servos may be half calibrated: {error}")


def calibrate(bench: Bench, before: dict[str, Servo], ask: Ask | None) -> Calibration:
    """Measure the servos, store the result, and drive once more.

    ask: returns how far the robot went [m]; None to use the lidar.
    """
    bench.check(lidar=ask is None)
    bias = mean(bench.drive(0, 0, REST), "gyro/z")
    fits = {side: _fit(bench, side, before[side], bias) for side in SIDES}
    found = {side: servo for side, (servo, _) in fits.items()}
    bench.store(found)
    ratio, half = _ratio(bench, found) if ask is None else _ruled(bench, found, ask)
    if abs(ratio - 1) > DOUBT:
        warn(
            f"the way it went is {ratio:.2f} times that of its gyroscope: a wheel "
            "slips, or is of another size"
        )
    # A gyroscope knows the wheels' speed only as a share of the track.
    halves = {
        side: replace(
            one,
            top_speed=math.hypot(one.top_speed * ratio, found[side].top_speed * half),
        )
        for side, (_, one) in fits.items()
    }
    found = {side: one.scaled(ratio) for side, one in found.items()}
    bench.store(found)
    track = bench.parameters.track
    last = _last(bench, found, track * ratio, bias, ask)
    return Calibration(found, halves, track * ratio, track * half, last)


def _fit(bench: Bench, side: str, servo: Servo, bias: float) -> tuple[Servo, Servo]:
    """Turn about the other wheel at several speeds; return figures and halves."""
    p = bench.parameters
    lever = p.track / p.wheel_radius * (-1 if side == "left" else 1)
    top = min(servo.top_speed, p.max_wheel_speed)
    told = [sign * level * top for level in LEVELS for sign in (1, -1)]
    found = []
    for speed in told:
        left, right = (speed, 0.0) if side == "left" else (0.0, speed)
        bench.drive(left, right, SETTLE)
        rate = mean(bench.drive(left, right, MEASURE), "gyro/z") - bias
        found.append(lever * rate)
    bench.stand()
    try:
        fitted, spread, freedom = fit(servo, told, found)
    except ExperimentError as error:
        raise ExperimentError(f"The {side} wheel: {error}") from None
    return fitted, spread.times(student(freedom))


def _ratio(bench: Bench, servos: dict[str, Servo]) -> tuple[float, float]:
    """Return driven by estimated distance, by the lidar, and its half interval.

    It is the true track by the assumed one, too: the gyroscope's speeds are estimated
    with the assumed track, and the lidar's are not.
    """
    went, believed = [], []
    for _ in range(TIMES):
        for sign in (1, -1):
            before = bench.wall(LOOK)
            believed.append(bench.go(_top(bench, servos), sign * WAY))
            went.append(sign * (before - bench.wall(LOOK)))
    ratio = _divided(sum(went), sum(believed))
    each = [one / way for one, way in zip(went, believed, strict=True)]
    return ratio, student(len(each) - 1) * stdev(each) / math.sqrt(len(each))


def _ruled(bench: Bench, servos: dict[str, Servo], ask: Ask) -> tuple[float, float]:
    """Return the same by a ruler: one drive."""
    believed = bench.go(_top(bench, servos), 2 * WAY)
    return _divided(ask(), believed), RULER / believed


def _last(
    bench: Bench, servos: dict[str, Servo], track: float, bias: float, ask: Ask | None
) -> Last:
    """Turn in a circle, and drive; compare with the calibrated estimate.

    With a ruler it drives back: it has just driven twice as far ahead.
    """
    speed = LAST * _top(bench, servos)
    turned, believed = bench.turn(speed, CIRCLE, bias)
    before = bench.wall(LOOK) if ask is None else 0.0
    way = bench.go(speed, -WAY if ask else WAY)
    went = ask() if ask else before - bench.wall(LOOK)
    return Last(went, way, turned, believed * bench.parameters.track / track)


def _top(bench: Bench, servos: dict[str, Servo]) -> float:
    speeds = (one.top_speed for one in servos.values())
    return float(min(bench.parameters.max_wheel_speed, *speeds))


def _divided(went: float, believed: float) -> float:
    if believed <= 0 or not 0.2 < went / believed < 5:
        raise ExperimentError(
            f"It went {100 * went:.0f} cm, and should have gone {100 * believed:.0f}: "
            "did it run into something, or was it lifted? (R0712)"
        )
    return went / believed
