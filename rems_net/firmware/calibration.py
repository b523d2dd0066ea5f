"""Calibration: find a wheel servo's properties from pulses and measured speeds.

A servo turns with `top_speed * (|u| - dead_band) / (500 - dead_band)`, where u is its
pulse less 1500 and less its trim [us]: settings.h and motors.c of the firmware.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rems_net.errors import ExperimentError

Floats = NDArray[np.float64]

#: us from the middle at which a servo is fastest; from motors.c.
REACH = 500.0
#: rad/s. A servo that turns more slowly is in its dead band, or sticks.
STILL = 0.2
#: us. Largest values that the firmware accepts; from settings.c.
MOST_TRIM, MOST_DEAD_BAND = 500.0, 200.0


@dataclass(frozen=True)
class Servo:
    """The firmware's model of one servo: trim and dead band [us], top speed [rad/s]."""

    trim: float
    dead_band: float
    top_speed: float
    reversed: bool

    def pulse(self, speed: float) -> float:
        """Return the pulse for a wheel's speed [rad/s], in us from the middle."""
        speed = min(max(speed, -self.top_speed), self.top_speed)
        if speed == 0:
            return self.trim
        share = self.dead_band + (REACH - self.dead_band) * abs(speed) / self.top_speed
        return self.trim + (share if (speed > 0) != self.reversed else -share)

    def scaled(self, by: float) -> "Servo":
        """Return this servo with its top speed multiplied by `by`."""
        return replace(self, top_speed=self.top_speed * by)

    def times(self, by: float) -> "Servo":
        """Return deviations, all multiplied by `by`."""
        return replace(
            self.scaled(by), trim=self.trim * by, dead_band=self.dead_band * by
        )


def fit(
    servo: Servo, told: Sequence[float], found: Sequence[float]
) -> tuple[Servo, Servo, int]:
    """Return the servo that fits the measured speeds best, and how well it is known.

    That is standard deviations, from the distance of the measured speeds from the
    fitted line, and their degrees of freedom.

    servo: the firmware's model during the measurement. told: commanded speeds [rad/s],
    a few ahead and as many backwards. found: the measured speeds [rad/s]. Raises
    ExperimentError if it does not turn, turns the wrong way, or is no servo.
    """
    speeds = np.asarray(told, dtype=float)
    turned = np.asarray(found, dtype=float)
    if np.abs(turned).max() < 0.1 * np.abs(speeds).max():
        raise ExperimentError(
            "it does not turn. Is it plugged in, and is the battery on? Or does "
            "another program command the robot? (R0712)"
        )
    if float(turned @ speeds) < 0:
        raise ExperimentError(
            "it turns the wrong way, or the plugs of both are swapped. Swap them, or "
            f"set its reversed to {'no' if servo.reversed else 'yes'}. (R0712)"
        )
    moves = np.abs(turned) > STILL
    speeds, turned = speeds[moves], turned[moves]
    ahead = speeds > 0
    if min(ahead.sum(), (~ahead).sum()) < 1 or len(speeds) < 3:
        raise ExperimentError(
            "it hardly turns in one direction: is something in its way? (R0712)"
        )
    # One slope, and for each direction where it begins.
    pulses = np.array([servo.pulse(speed) for speed in speeds])
    rows = np.column_stack([pulses, ahead, ~ahead]).astype(float)
    line, *_ = np.linalg.lstsq(rows, turned, rcond=None)
    slope = line[0]
    if slope == 0 or (slope > 0) == servo.reversed:
        raise ExperimentError(
            "its speed does not grow with its pulse: is it worn? (R0712)"
        )
    trim, band, top = _figures(line, servo.reversed)
    if abs(trim) > MOST_TRIM or band > MOST_DEAD_BAND:
        raise ExperimentError(
            f"a trim of {trim:.0f} us and a dead band of {band:.0f} us are no servo's: "
            "did something hold the robot? (R0712)"
        )
    freedom = max(1, len(turned) - len(line))
    variance = float(((turned - rows @ line) ** 2).sum()) / freedom
    spread = variance * np.linalg.inv(rows.T @ rows)
    off = _deviations(line, spread, servo.reversed)
    return Servo(trim, band, top, servo.reversed), off, freedom


def _deviations(line: Floats, spread: Floats, mirrored: bool) -> Servo:
    """Return deviations of what `_figures` finds, by those of the fitted line."""
    base = np.array(_figures(line, mirrored))
    steps = 1e-6 * np.maximum(np.abs(line), 1e-6)
    slopes = np.array(
        [
            (np.array(_figures(line + step, mirrored)) - base) / step.max()
            for step in np.diag(steps)
        ]
    )
    trim, band, top = np.sqrt(np.einsum("ik,ij,jk->k", slopes, spread, slopes))
    return Servo(float(trim), float(band), float(top), mirrored)


def _figures(line: Floats, mirrored: bool) -> tuple[float, float, float]:
    """Return trim and dead band [us], and top speed [rad/s], of a fitted line."""
    slope, one, other = map(float, line)
    starts, ends = -one / slope, -other / slope
    # Noise can make a dead band of zero look negative.
    band = max(0.0, (starts - ends) / 2 * (-1 if mirrored else 1))
    return (starts + ends) / 2, band, abs(slope) * (REACH - band)
