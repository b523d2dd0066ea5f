"""Noise: how far each sensor of a recording is from what its robot's place means.

The definition's `measure` computes the true value from the recorded state. The rest
is noise if the state itself is exact, as in a simulation or under a camera.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rems_net.agents.robot import Robot
from rems_net.drivers.kinematic.correction import limits
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.drivers.kinematic.swarm import Columns as Arrays
from rems_net.identification.drive import Floats, settled, share

if TYPE_CHECKING:
    from rems_net.recordings.table import Columns

#: Rows. From fewer, a standard deviation is not known to a quarter of itself.
LEAST = 30
#: Deviations from the usual error; farther ones are left out.
FAR = 4.0
#: Share of 1 by which the normal distribution's median error is below its deviation.
MEDIAN = 1.4826
#: Correlations of readings with true values: below, of a turned sign and of none.
OPPOSITE, UNLIKE = 0.7, 0.3
#: Errors of rounding, in the field's unit.
ROUND = 1e-9


@dataclass(frozen=True)
class SensorNoise:
    """Noise of one field: its standard deviation, from `rows` rows.

    relative: share of the true value; 0 if it is the same everywhere
    absolute: in `unit`; 0 if it is relative      bias: constant offset, in `unit`
    fault: why the readings are no noisy true values; "" if they are
    """

    name: str
    unit: str
    rows: int
    relative: float = 0.0
    absolute: float = 0.0
    bias: float = 0.0
    fault: str = ""

    @property
    def known(self) -> bool:
        """Whether the recording shows it."""
        return not self.fault and self.rows >= LEAST

    def figures(self) -> dict[str, float]:
        """Return what a simulated sensor needs: those that are not 0, rounded."""
        sizes = {"relative": self.relative, "absolute": self.absolute}
        sizes["bias"] = abs(self.bias)
        return {name: float(f"{size:.4g}") for name, size in sizes.items() if size}

    def __str__(self) -> str:
        if self.fault:
            return f"{self.name}: {self.fault}; its noise is not known."
        if self.rows < LEAST:
            return f"{self.name}: {self.rows} rows are too few for its noise."
        size = f"{self.absolute:.3g} {self.unit}".strip()
        if self.relative:
            size = f"{100 * self.relative:.1f} % of the value"
        off = f", offset {self.bias:.2g} {self.unit}".rstrip() if self.bias else ""
        return f"{self.name}: noise {size}{off} ({self.rows} rows)."


def noise_of(columns: "Columns", robot: Kinematic) -> list[SensorNoise]:
    """Return the noise of each sensor that was recorded, is computed, and deviates."""
    state, command = (
        _arrays(columns, robot, "state"),
        _arrays(columns, robot, "command"),
    )
    if robot.read is None or state is None or command is None:
        return []
    rows = settled(columns)
    true = robot.read(state, command)
    found = []
    for path, one in robot.sensors.schema.rows():
        name = f"sensors/{path}"
        if name in columns and path in true:
            read = share(columns, name, one.unit, 1.0)[rows]
            value = np.broadcast_to(np.asarray(true[path], float), read.shape)
            noise = _noise(path, one.unit, read, value)
            exact = noise.rows >= LEAST and noise.absolute + noise.relative < ROUND
            if noise.fault or not exact:
                found.append(noise)
    return found


def _arrays(columns: "Columns", robot: Robot, port: str) -> Arrays | None:
    """Return the columns of a port, for a definition's mathematics; None if not all."""
    schema, rows = robot.schemas()[port], settled(columns)
    most = limits(schema)
    if any(f"{port}/{path}" not in columns for path in most):
        return None
    return Arrays(
        {
            path: most[path]
            * share(columns, f"{port}/{path}", one.unit, most[path])[rows]
            for path, one in schema.rows()
        }
    )


def _noise(name: str, unit: str, read: Floats, true: Floats) -> SensorNoise:
    # A sensor at its limit, such as a wall out of reach, shows no noise.
    inside = np.isfinite(read) & (np.abs(read) < np.abs(read).max() * (1 - 1e-9))
    read, true = read[inside], true[inside]
    off = read - true
    if len(off) >= LEAST and (fault := _fault(read, true)):
        return SensorNoise(name, unit, len(off), fault=fault)
    bias = float(np.median(off)) if len(off) else 0.0
    usual = MEDIAN * float(np.median(np.abs(off - bias))) if len(off) else 0.0
    near = np.abs(off - bias) <= FAR * usual + ROUND
    off, true = off[near], true[near]
    if len(off) < LEAST:
        return SensorNoise(name, unit, len(off))
    bias = float(off.mean())
    absolute = float(off.std(ddof=1))
    if abs(bias) < 3 * absolute / np.sqrt(len(off)):
        bias = 0.0
    size = np.abs(true) + 1e-12
    share = (off - bias) / size
    relative = float(np.sqrt((share**2).mean()))
    # Which of the two normal distributions makes these errors more probable?
    if absolute and np.log(relative) + np.log(size).mean() < np.log(absolute):
        return SensorNoise(name, unit, len(off), relative=relative, bias=bias)
    return SensorNoise(name, unit, len(off), absolute=absolute, bias=bias)


def _fault(read: Floats, true: Floats) -> str:
    """Return why readings are no noisy true values; "" if they may be."""
    size = float(read.std() * true.std())
    if size < ROUND:
        return ""
    alike = float(((read - read.mean()) * (true - true.mean())).mean()) / size
    if alike < -OPPOSITE:
        return "its sign is turned round"
    return "" if alike > UNLIKE else "it does not follow what the definition computes"
