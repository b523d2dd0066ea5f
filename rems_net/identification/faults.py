"""Faults of a recording that no parameter can explain: they are named, not fitted."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rems_net.errors import ExperimentError
from rems_net.identification.drive import Drive, Floats
from rems_net.identification.fit import Fit
from rems_net.identification.prediction import Predictor, cut

#: s. Length of the predictions by which signs are compared.
LOOK = 1.0
#: Share of the error that is left with another sign if the sign is wrong.
TURNED = 0.25
#: Correlation of turning with its command below which the heading's sign is wrong.
OPPOSITE = -0.7
#: Seconds by which clocks part in a second, and deviations of this from 0, that count.
DRIFT, SURE = 2e-3, 4.0
#: Number of segments below which a drift cannot be seen.
FEW = 8


def check_motion(predictor: Predictor, drives: Sequence[Drive]) -> None:
    """Raise ExperimentError if nothing moves, or moves the wrong way."""
    moves = [values for drive in drives for values in drive.state.values()]
    if not any(np.ptp(values) > 0 for values in moves):
        which = ", ".join(drive.name for drive in drives)
        raise ExperimentError(
            f"nothing moves in the recording of {which}. Record a drive in curves "
            "of both directions, with pauses. (R0860)"
        )
    segments = cut(drives, LOOK)
    read = np.array([*segments.read.values()])
    model = predictor(segments, segments.starts(), {})
    if "heading" in segments.read:
        n = list(segments.read).index("heading")
        turns, real = np.diff(model[n]).ravel(), np.diff(read[n]).ravel()
        size = float(np.sqrt((turns**2).sum() * (real**2).sum()))
        if size and float((turns * real).sum()) < OPPOSITE * size:
            raise ExperimentError(
                "'heading' turns the other way than its command. Exchange the left "
                "and the right motor, or turn the sign of what measures 'heading'; a "
                "wrong sign is not fitted. (R0864)"
            )
    scale = read.std(axis=(1, 2)) + 1e-9
    error = _error(model - read, segments.weight, scale)
    for path in drives[0].command:
        turned = [_turned(drive, path) for drive in drives]
        signs = cut(turned, LOOK)
        other = predictor(signs, signs.starts(), {}) - read
        if _error(other, segments.weight, scale) < TURNED * error:
            raise ExperimentError(
                f"what obeys {path!r} goes the other way than its command. Turn the "
                "sign of this command, or of its motor; a wrong sign is not fitted. "
                "(R0864)"
            )


def _turned(drive: Drive, path: str) -> Drive:
    """Return a drive with the other sign of a command."""
    return replace(drive, command={**drive.command, path: -drive.command[path]})


def _error(off: Floats, weight: Floats, scale: Floats) -> float:
    """Return the median over the segments of the squared error: jolts do not count."""
    each = (off**2 * weight).sum(axis=2) / scale[:, None] ** 2
    return float(np.median(each.sum(axis=0)))


def drifting(late: Floats, begin: Floats) -> float:
    """Return the seconds by which readings are later in each second; 0 if not sure.

    late: (S,) s, by which each segment's readings are late      begin: (S,) s
    """
    if len(late) < FEW or not np.ptp(begin):
        return 0.0
    off = begin - begin.mean()
    slope = float((off * late).sum() / (off**2).sum())
    rest = late - late.mean() - slope * off
    spread = float(np.sqrt((rest**2).sum() / (len(late) - 2) / (off**2).sum()))
    return slope if abs(slope) > max(DRIFT, SURE * spread) else 0.0


def check_clocks(found: Fit) -> None:
    """Raise ExperimentError if the readings' clock runs at another pace."""
    if drift := drifting(np.array(found.late), np.array(found.begin)):
        pace = "slower" if drift < 0 else "faster"
        raise ExperimentError(
            f"the clock of the readings is {pace} than that of the commands: they "
            f"part by {1e3 * abs(drift):.1f} ms in each second. Stamp both by one "
            "clock, and record again. (R0866)"
        )


def describe_jolts(found: Fit) -> str:
    """Return a sentence about the segments that were left out; "" if none was."""
    if not found.jolts:
        return ""
    count, stood = len(found.jolts), len(found.stood)
    when = ", ".join(f"{t:.0f}" for t in found.jolts[:5])
    why = "somebody has pushed the robot, or a reading was wrong"
    if stood:
        why = "it stood while it was commanded to go: a wall, or somebody has lifted it"
        why = why if stood == count else f"in {stood} of them {why}"
    return (
        f"{count} of {found.segments + count} segments do not fit and are left out "
        f"(from {when} s): {why}"
    )
