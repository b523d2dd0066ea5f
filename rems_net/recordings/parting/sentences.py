"""Sentences for explanations: what the second robot does, and where to look next."""

from collections.abc import Mapping
from math import degrees, pi

import numpy as np

from rems_net.recordings.parting.kinds import SIGN
from rems_net.recordings.parting.pair import RobotPair
from rems_net.recordings.parting.trajectory import NEAR, Array
from rems_net.recordings.parting.trajectory_pair import TrajectoryPair
from rems_net.recordings.parting.where import near

#: Factors that are more likely a mistake than a measurement.
FACTORS = {
    180 / pi: "degrees for radians?",
    pi / 180: "radians for degrees?",
    1000.0: "m for mm?",
    0.001: "mm for m?",
    100.0: "m for cm?",
    0.01: "cm for m?",
    60.0: "per minute for per second?",
    1 / 60: "per second for per minute?",
    2 * pi: "turns for radians?",
    1 / (2 * pi): "radians for turns?",
    -1.0: "the wrong sign?",
    2.0: "a diameter for a radius?",
    0.5: "a radius for a diameter?",
}
#: rows, fraction. Delays of commands up to DELAYED are tried; one is accepted if fewer
#: than MOSTLY of the differing rows still differ with it.
DELAYED, MOSTLY = 50, 0.1
#: fraction of the largest deviation. Smaller components are not shown.
TRIFLE = 0.05
#: fraction of the path. A robot so near to its target has reached it.
THERE = 0.01
VERBS = {"all": "goes and turns", "way": "goes", "turn": "turns"}


def says(
    name: str,
    numbers: Mapping[str, Array],
    both: RobotPair,
    case: TrajectoryPair,
    field: str,
) -> str:
    """Return what this explanation claims about `b`: "turns 1.1 times as much"."""
    by, unit = numbers[name], both.a.unit(field) if field else ""
    drive = bool(case.a.turns)
    if name in VERBS:
        verb = VERBS[name] if drive else "goes"
        return _times(verb, float(by[0]), "far" if name == "way" else "much")
    if name == "later":
        late = float(by[0])
        return f"is {_time(abs(late))} {'later' if late > 0 else 'earlier'}"
    if name == "drift":
        what = _turns(by[0], "/s") if drive else _more(by[0], unit)
        return f"{what}, all the time"
    if name == "bend":
        return f"{_turns(by[0])} in each metre"
    if name == "offset":
        return f"is {_amount(by[0], unit)} off all the time"
    if name == "creep":
        what = _creeps(by) if drive else _more(by[0], unit)
        return f"{what} while {both.a.name} stands"
    if name == "jolt":
        if not drive:
            return f"jumps by {_amount(by[1], unit)} at {by[0]:.2f} s"
        return f"gets {side(*by[1:])} at {by[0]:.2f} s"
    if name == "limit":
        return f"never goes faster than {abs(by[0]):.3g} {'m' if drive else unit}/s"
    if name == "start":
        return _start(case, unit)
    return _told(both, case) if name == "told" else _episode(both, case, field)


def look(
    name: str, numbers: Mapping[str, Array], both: RobotPair, case: TrajectoryPair
) -> str:
    """Return where to look for the cause."""
    if not case.a.turns:
        return JOINT.get(name, "")
    if name in VERBS:
        return f"{DRIVE[name]}{_wheels(both, float(numbers[name][0]))}"
    return DRIVE[name]


DRIVE = {
    "told": "the commands of each: rems plot DIR command",
    "start": "where they start: `initial` of both",
    "all": "wheel_radius, the speed of wheels at one command, units",
    "way": "wheel_radius and track, wheels that slip, what it pushes",
    "turn": "track, wheels that slip where it turns",
    "drift": "the zero of a gyro or of a wheel",
    "bend": "left and right wheel: radius, speed at one command, load",
    "creep": "the zero of motors, wheels that slide while they are braked",
    "later": "time that motors need (torque, mass, gears), the way to a device",
    "limit": "what its motors can: top speed, torque, load",
    "jolt": "what touched it then, how it stood there, whether it had to speed up",
    "episode": "what was in its way: sensors, walls, other robots",
}
JOINT = {
    "told": DRIVE["told"],
    "start": DRIVE["start"],
    "offset": "a zero, a bias",
    "way": "units, a gear, a stop",
    "drift": "a speed without a zero, gravity",
    "creep": "gravity, a servo that is too weak to hold",
    "later": "speed and torque of its servo, the way to a device",
    "limit": "what its servo can: speed, torque, load",
    "jolt": "what touched it then; teeth that slip",
    "episode": "stops, torque, what was in its way",
}


def _times(verb: str, factor: float, much: str) -> str:
    if abs(factor) < 0.02:
        return "hardly moves" if verb != "turns" else "hardly turns"
    mistake = next((w for f, w in FACTORS.items() if _is(factor, f)), "")
    shown = f"{factor:.4f}" if abs(factor - 1) < 0.02 else f"{factor:.3g}"
    return f"{verb} {shown} times as {much}" + (f" ({mistake})" if mistake else "")


def _is(factor: float, known: float) -> bool:
    """Return whether a fitted factor is a known one; no other factor is negative."""
    return abs(factor / known - 1) < (SIGN if known < 0 else 0.01)


def _time(seconds: float) -> str:
    return f"{seconds:.2f} s" if seconds >= 0.1 else f"{1e3 * seconds:.2g} ms"


def _turns(angle: float, each: str = "") -> str:
    side = "left" if angle > 0 else "right"
    return f"turns {abs(degrees(angle)):.2g} deg{each} more to the {side}"


def _more(rate: float, unit: str) -> str:
    return f"goes {rate:+.2g}{f' {unit}' if unit else ''}/s more"


def _creeps(by: Array) -> str:
    ahead, left, turn = by
    speed = length(float(np.hypot(ahead, left)), 2)
    return f"creeps {speed}/s, {degrees(turn):+.2g} deg/s"


def _start(case: TrajectoryPair, unit: str) -> str:
    off = case.b.points[0] - case.a.points[0]
    if not case.a.turns:
        return f"starts {_amount(off[0], unit)} away"
    way, turn = float(np.hypot(*off[:2])), float(off[2])
    least = TRIFLE * max(way, NEAR * abs(turn))
    words = [length(way)] if way > least else []
    words += [f"{degrees(turn):+.3g} deg"] if NEAR * abs(turn) > least else []
    return f"starts {' and '.join(words)} away"


def _amount(number: float, unit: str) -> str:
    return f"{number:+.3g} {unit}".rstrip()


def length(way: float, digits: int = 3) -> str:
    """Return a length in words: in mm below 1 m."""
    return f"{1e3 * way:.{digits}g} mm" if way < 0.9995 else f"{way:.{digits}g} m"


def side(ahead: float, left: float, turn: float) -> str:
    """Return a position, such as "3.1 mm behind, turned +2 deg", without trifles."""
    ways = (
        (ahead, "ahead" if ahead > 0 else "behind"),
        (left, "to the left" if left > 0 else "to the right"),
    )
    most = max(abs(ahead), abs(left), NEAR * abs(turn))
    shown = [(abs(way), to) for way, to in ways if abs(way) > TRIFLE * most]
    words = [f"{length(way, 2)} {to}" for way, to in shown]
    if NEAR * abs(turn) > TRIFLE * most:
        words.append(f"turned {degrees(turn):+.2g} deg")
    return ", ".join(words)


def _told(both: RobotPair, case: TrajectoryPair) -> str:
    """Return from when on the commands of `b` differ, and whether they are to stand."""
    first, where, stands = len(both.time), "", True
    for field in both.fields("command"):
        one, other = both.numbers(field)
        rows = np.flatnonzero(one != other)
        if len(rows) and rows[0] < first:
            first = int(rows[0])
            unit = f" {both.a.unit(field)}" * bool(both.a.unit(field))
            name = field.removeprefix("command/")
            where = f"{name} {other[first]:.3g}, not {one[first]:.3g}{unit}"
        stands &= not np.any(other[rows])
    since = f"from {both.time[first]:.2f} s on"
    if delay := _delayed(both):
        return f"receives the same commands {_time(delay)} later"
    if stands:
        return f"is commanded to stand while {both.a.name} is not, {since}"
    if case.started and np.any(
        (case.b.points - case.a.points)[case.a.time < both.time[first]]
    ):
        since += ", when they had parted"
    return f"does not receive the same commands {since}: {where}"


def _delayed(both: RobotPair) -> float:
    """Return the delay after which `b` gets the commands of `a`, s; 0 for none."""
    pairs = [both.numbers(field) for field in both.fields("command")]
    one, other = (np.stack(columns, axis=1) for columns in zip(*pairs, strict=True))
    now = np.any(one != other, axis=1).mean()
    for rows in range(1, min(DELAYED, len(both.time) // 2)):
        if np.any(one[:-rows] != other[rows:], axis=1).mean() < MOSTLY * now:
            return float(both.time[rows] - both.time[0])
    return 0.0


def _episode(both: RobotPair, case: TrajectoryPair, field: str) -> str:
    rows, held = case.apart.rows, case.apart.held
    ends = case.b.time[1:][rows]
    begun = f"from {ends[0]:.2f} s on, for {case.a.dt()[rows].sum():.2g} s"
    begun += _missed(both, case, field)
    if held is None:
        return f"moves otherwise {begun}{_near(both, ends)}"
    if held:
        return f"is held {begun}{_near(both, ends)}"
    return f"goes on {begun}, while {both.a.name} is held{_near(both, ends)}"


def _missed(both: RobotPair, case: TrajectoryPair, field: str) -> str:
    """Return how far `b` misses its target when `a` has reached it; "" for little."""
    aim = field.replace("state/", "command/", 1)
    if not field or aim not in both.fields("command"):
        return ""
    points, aims = both.numbers(field), both.numbers(aim)
    one, other = (np.abs(points[k] - aims[k]) for k in range(2))
    way = float(np.ptp(case.a.points))
    most = float(other[one < THERE * way].max(initial=0.0))
    if most < TRIFLE * way:
        return ""
    unit = f" {both.a.unit(field)}" * bool(both.a.unit(field))
    return f"; up to {most:.2g}{unit} off its target when {both.a.name} is there"


def _near(both: RobotPair, ends: Array) -> str:
    """Return what is near the robots then, if the recordings contain it."""
    rows = np.isin(both.time, ends)
    found = []
    for which, robot in ((1, both.b), (0, both.a)):
        for what in near(both, which, rows)[:1]:
            found.append(f"{robot.name}: {what}")
    return f" ({'; '.join(found)})" if found else ""


def _wheels(both: RobotPair, factor: float) -> str:
    """Compare how far the wheels turned; "" if the recordings do not contain it."""
    ratios = []
    for field in both.fields("state"):
        if field.startswith("state/wheel"):
            one, other = (np.diff(c) for c in both.numbers(field))
            if np.any(one):
                ratios.append(float(one @ other / (one @ one)))
    if not ratios:
        return ""
    most = max(ratios, key=lambda ratio: abs(ratio - 1))
    if abs(most - 1) < 0.25 * abs(factor - 1):
        return "; its wheels turn alike, so it is the floor or a length"
    return f"; its wheels turn {most:.3g} times as much"
