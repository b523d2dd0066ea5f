"""Noise: random errors of sensors, on request, the same in every run."""

from bisect import bisect
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from math import inf, pi, sqrt
from random import Random
from typing import Any

from rems_net.defdict import DefDict, Schema
from rems_net.errors import SchemaError
from rems_net.maths import log, sincos


@dataclass(frozen=True, slots=True)
class Noise:
    """Random deviation of a sensor from the true value.

    relative: standard deviation as a share of the value
    absolute: standard deviation in the field's own unit
    bias: greatest constant offset, in the field's own unit
    table: pairs of a value, rising, and the standard deviation there, both in the
        field's own unit, linear in between
    step: values are multiples of this, as an encoder's counts are; 0 for none
    """

    relative: float = 0.0
    absolute: float = 0.0
    bias: float = 0.0
    table: tuple[tuple[float, float], ...] = ()
    step: float = 0.0

    def __post_init__(self) -> None:
        spreads = [spread for _, spread in self.table]
        if min(self.relative, self.absolute, self.bias, self.step, *spreads) < 0:
            raise SchemaError(f"Noise is not less than 0; got {self}. (R0214)")
        reads = [read for read, _ in self.table]
        if reads != sorted(set(reads)):
            raise SchemaError(
                f"The readings in a table of noise rise; got {reads}. (R0214)"
            )

    def spread(self, true: float) -> float:
        """Return the standard deviation at this true value."""
        spread = self.relative * abs(true) + self.absolute
        if not self.table:
            return spread
        after = bisect(self.table, (true, inf))
        if after in (0, len(self.table)):  # beyond the table it is as at its end
            return spread + self.table[max(after - 1, 0)][1]
        (low, a), (high, b) = self.table[after - 1 : after + 1]
        return spread + a + (b - a) * (true - low) / (high - low)


def read_noises(given: Mapping[str, Any], what: str) -> dict[str, Noise]:
    """Return noise from tables: {"gyro/z": {"absolute": 0.01}}. Raises SchemaError."""
    found = {}
    for path, values in given.items():
        try:
            sizes: dict[str, Any] = {key: float(one) for key, one in values.items()}
            found[path] = replace(Noise(), **sizes)
        except (AttributeError, TypeError, ValueError):
            raise SchemaError(
                f"{what} has {path!r} = {values!r:.60}; expected such as {{ relative = "
                "0.04 }, or absolute and bias in the sensor's own unit. (R0883)"
            ) from None
    return found


class Noisy:
    """Source of noise for sensors, with its own random numbers.

    noises: by path of the sensors, or by a glob such as "lidar/*"
    seed: of the random numbers; the same seed gives the same noise, to the last bit, on
    every system
    """

    def __init__(self, schema: Schema, noises: Mapping[str, Noise], seed: str):
        # Of several that name a sensor, the last one counts.
        self._rows = [*{row[0]: row for row in _rows(schema, noises)}.values()]
        random = Random(seed)
        self._normal = _normal(random)
        self._biases = [
            noise.bias * (2 * random.random() - 1) for _, noise, _ in self._rows
        ]

    def add(self, sensors: DefDict) -> None:
        """Add noise to the sensors; they stay within the fields' ranges."""
        for (path, noise, limits), bias in zip(self._rows, self._biases, strict=True):
            true = sensors[path]
            read = true + noise.spread(true) * next(self._normal) + bias
            if noise.step:
                read = round(read / noise.step) * noise.step
            sensors[path] = min(max(read, limits[0]), limits[1])


def _rows(
    schema: Schema, noises: Mapping[str, Noise]
) -> Iterator[tuple[str, Noise, tuple[float, float]]]:
    for pattern, noise in noises.items():
        found = [
            (path, noise, field.limits)
            for path, field in schema.rows()
            if fnmatchcase(path, pattern) and field.dtype == "float" and not field.shape
        ]
        if not found:
            raise SchemaError(
                f"noise() names {pattern!r}, and no number of {schema.name} has "
                f"that name; there is {', '.join(schema.paths)}. (R0214)"
            )
        yield from found


def _normal(random: Random) -> Iterator[float]:
    """Yield random numbers of mean 0 and standard deviation 1 (Box and Muller)."""
    while True:
        # Our own log: the last bit of the C library's differs between systems.
        length = sqrt(-2.0 * log(1.0 - random.random()))
        sine, cosine = sincos(2 * pi * random.random())
        yield length * cosine
        yield length * sine
