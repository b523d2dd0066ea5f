"""Noise: what sensors read beside the truth, on request, the same in every run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from math import pi, sqrt
from random import Random

from rems_net.defdict import DefDict, Schema
from rems_net.errors import SchemaError
from rems_net.maths import log, sincos


@dataclass(frozen=True, slots=True)
class Noise:
    """How far a sensor is from the truth, by chance.

    relative: standard deviation as a share of what is read
    absolute: standard deviation in the field's own unit
    bias: an offset that stays, as large as this at the most, in the field's own unit
    """

    relative: float = 0.0
    absolute: float = 0.0
    bias: float = 0.0

    def __post_init__(self) -> None:
        if min(self.relative, self.absolute, self.bias) < 0:
            raise SchemaError(f"Noise is not less than 0; got {self}.")


class Noisy:
    """Adds noise to sensors, from random numbers of its own.

    noises: by path of the sensors, or by a glob such as "lidar/*"
    seed: what the numbers come from; the same seed gives the same noise, to the last
    bit, on every system
    """

    def __init__(self, schema: Schema, noises: Mapping[str, Noise], seed: str):
        self._rows = list(_rows(schema, noises))
        random = Random(seed)
        self._normal = _normal(random)
        self._biases = [
            noise.bias * (2 * random.random() - 1) for _, noise, _ in self._rows
        ]

    def add(self, sensors: DefDict) -> None:
        """Change what was read; it stays within the fields' ranges."""
        for (path, noise, limits), bias in zip(self._rows, self._biases, strict=True):
            true = sensors[path]
            spread = noise.relative * abs(true) + noise.absolute
            read = true + spread * next(self._normal) + bias
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
                f"noise() speaks of {pattern!r}, and no number of {schema.name} is "
                f"called so; there is {', '.join(schema.paths)}."
            )
        yield from found


def _normal(random: Random) -> Iterator[float]:
    """Numbers of mean 0 and standard deviation 1 (Box and Muller)."""
    while True:
        # Of the C library's logarithm the last bit differs from system to system.
        length = sqrt(-2.0 * log(1.0 - random.random()))
        sine, cosine = sincos(2 * pi * random.random())
        yield length * cosine
        yield length * sine
