"""Actuators: how motors follow their command, with delay, lag, dead band and gain.

A definition states them as a group of its parameters, all off by default:

    parameters = Settings(actuation=actuation("wheel/left", "wheel/right"), ...)

A command passes the dead band and the gain of its motor, then the delay, then the lag:
the motor's speed approaches what is commanded with this time constant. Drivers keep a
command for a whole tick, so what acts is the mean speed over the tick.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rems_net.defdict import DefDict, Schema, number, time
from rems_net.maths import exp

Floats = NDArray[np.float64]

#: name of the group of parameters
GROUP = "actuation"
#: Ratio. Greatest gain of a motor; a motor's speed may exceed its command by it.
GAIN = 2.0
#: s. Greatest lag and delay.
LONGEST = 2.0
#: Share of full speed. Greatest dead band.
WIDEST = 0.9
#: s. A piece of a command that is shorter than this is a rounding error.
SHORT = 1e-12


def actuation(
    *fields: str,
    lag: float | str = 0.0,
    delay: float | str = 0.0,
    dead_band: float = 0.0,
    gain: Mapping[str, float] | None = None,
) -> Schema:
    """Return the parameters of motors that obey these fields of the command.

    lag, delay: a number of seconds, or a text with a unit, such as "90 ms"
    dead_band: share of full speed below which the motors stand; full speed stays
    gain: by field, speed of its motor as a share of what is commanded; 1 if not given
    """
    gains = dict.fromkeys(fields, 1.0) | dict(gain or {})
    span = (0.0, LONGEST)
    return Schema(
        GROUP,
        {
            "lag": time(
                default=lag, range=span, doc="time constant of the motors; 0: none"
            ),
            "delay": time(
                default=delay, range=span, doc="from a command to its motor; 0: none"
            ),
            "dead_band": number(
                default=dead_band,
                range=(0.0, WIDEST),
                doc="share of full speed below which motors stand; 0: none",
            ),
            **{
                f"gain/{path}": number(
                    default=one,
                    range=(0.0, GAIN),
                    doc="speed of this motor as a share of its command",
                )
                for path, one in gains.items()
            },
        },
    )


def driven(parameters: Schema) -> tuple[str, ...]:
    """Return the fields of the command that motors obey, by these parameters."""
    begin = f"{GROUP}/gain/"
    return tuple(p[len(begin) :] for p in parameters.paths if p.startswith(begin))


def shaped(asked: Any, band: Any, gain: Any) -> Any:
    """Return what a motor makes of a share of full speed, (...), before its lag."""
    beyond = np.maximum(np.abs(asked) - band, 0.0) / (1.0 - band)
    return gain * np.sign(asked) * beyond


def followed(speed: Any, asked: Any, lag: Any, dt: Any) -> tuple[Any, Any]:
    """Return a motor's speed after `dt` s, and its way in them, if `asked` is constant.

    lag: s; where it is 0, the speed is `asked` at once. Numbers, or arrays of them.
    """
    slow = lag > 0
    rest = exp(-dt / np.where(slow, lag, 1.0)) * slow
    off = speed - asked
    return asked + off * rest, asked * dt + off * lag * (1.0 - rest)


class Actuators:
    """The motors of one robot: a filter of its command, with the motors' state.

    fields: of the command that motors obey      rest: the command of a robot at rest
    """

    def __init__(self, fields: tuple[str, ...], parameters: DefDict, rest: DefDict):
        given = parameters[GROUP]
        self.fields, self.lag = fields, float(given["lag"])
        self.band = float(given["dead_band"])
        self.gains = np.array([given[f"gain/{path}"] for path in fields])
        most = [full(rest.schema, path) for path in fields]
        self.most: Floats = np.array(most)
        self._acts = widened(rest.schema, fields)()
        self._speed = self._shaped(rest)
        #: the commands that have not acted yet: seconds of each, and its speeds
        self._waiting = deque([(float(given["delay"]), self._speed)])

    @classmethod
    def of(cls, parameters: DefDict, rest: DefDict) -> "Actuators | None":
        """Return the motors by these parameters; None if they do all at once."""
        fields = driven(parameters.schema)
        if not fields:
            return None
        given = parameters[GROUP]
        off = not any(given[name] for name in ("lag", "delay", "dead_band"))
        plain = off and all(given[f"gain/{path}"] == 1.0 for path in fields)
        return None if plain else cls(fields, parameters, rest)

    def acting(self, command: DefDict, dt: float) -> DefDict:
        """Return the command whose mean effect the next `dt` seconds have.

        It is the same value each time, and its ranges leave room for the gains.
        """
        self._waiting.append((dt, self._shaped(command)))
        left, way = dt, np.zeros(len(self.fields))
        while left > SHORT:
            seconds, asked = self._waiting[0]
            part = min(seconds, left)
            self._speed, gone = followed(self._speed, asked, self.lag, part)
            way += gone
            left -= part
            if seconds - part > SHORT or len(self._waiting) == 1:
                self._waiting[0] = (seconds - part, asked)
            else:
                self._waiting.popleft()
        mean = self._speed if dt <= SHORT else way / dt
        speeds = dict(zip(self.fields, (mean * self.most).tolist(), strict=True))
        self._acts.update({**command.flat(), **speeds})
        return self._acts

    def _shaped(self, command: DefDict) -> Floats:
        asked = np.array([command[path] for path in self.fields]) / self.most
        found: Floats = shaped(asked, self.band, self.gains)
        return found


def full(schema: Schema, path: str) -> float:
    """Return the limit of a field that goes from -limit to limit; 1 for others."""
    one = schema.find(path)
    low, high = getattr(one, "limits", (0.0, 0.0))
    return float(high) if -low == high and 0 < high < np.inf else 1.0


@cache
def widened(schema: Schema, fields: tuple[str, ...]) -> Schema:
    """Return a schema whose fields take what motors of any gain do."""
    wide = {}
    for path, one in schema.rows():
        if path in fields and one.range is not None:
            low, high = one.range
            one = replace(one, range=(min(low, GAIN * low), max(high, GAIN * high)))
        wide[path] = one
    return Schema(schema.name, wide)
