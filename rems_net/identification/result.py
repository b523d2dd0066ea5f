"""Result: what an identification found, with units and intervals."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import pi
from pathlib import Path
from textwrap import wrap
from typing import Any

from rems_net.errors import ExperimentError
from rems_net.identification.noise import SensorNoise
from rems_net.identification.suggest import Suggestion
from rems_net.recordings.parameters.identified import Origin, write_identified
from rems_net.recordings.table import aligned

#: columns of a terminal
WIDE = 79


@dataclass
class Parameter:
    """One parameter: what it was, what fits, and what is known of it.

    before, value: in `unit`      half: half the width of its 95 % interval
    adopted: whether it predicts an unused part better      why: if not adopted
    """

    name: str
    unit: str
    before: float
    value: float
    half: float = 0.0
    adopted: bool = False
    why: str = ""

    def text(self, value: float) -> str:
        """Return a value with the unit."""
        return f"{value:.4g} {self.unit}".strip()


@dataclass
class Identified:
    """The result of an identification. Printed, it is a report.

    name: of the robot      rows: number      length: s, of its recording
    parameters: all that were tried
    before, after: by field of the state, RMS error of free runs over parts that were
    not used, with the parameters as they were, and with those that were adopted
    units: of these fields      seconds: mean length of these parts
    error: by field, RMS error of predictions over 2 s of what was used
    segments: number of these predictions      notes: sentences about the recordings
    noise: of the sensors, against what the definition computes from the state
    origin: of the parameters      stated: those that were known before
    suggestions: short drives, the one first that would show most; if asked for
    """

    name: str
    rows: int
    length: float
    parameters: list[Parameter]
    before: dict[str, float]
    after: dict[str, float]
    units: dict[str, str]
    seconds: float
    error: dict[str, float]
    segments: int
    notes: list[str] = field(default_factory=list)
    noise: list[SensorNoise] = field(default_factory=list)
    origin: Origin | None = None
    stated: Mapping[str, Any] = field(default_factory=dict)
    suggestions: list[Suggestion] = field(default_factory=list)

    def write(self, path: Path | str) -> None:
        """Write the parameters to a file, which an experiment's robot takes by name.

        Raises ExperimentError if none was adopted, and OSError.
        """
        sure = [one for one in self.noise if one.known]
        if self.origin is None or not (sure or self.adopted()):
            raise ExperimentError(
                f"no parameter or noise of {self.name} was found, so there is nothing "
                "to write; drive longer, and in curves of both directions. (R0880)"
            )
        remarks = {
            one.name: f"{one.value - one.half:.4g} to {one.value + one.half:.4g}, 95 % "
            f"interval; was {one.text(one.before)}"
            for one in self.parameters
            if one.adopted
        }
        remarks |= {one.name: f"{one.rows} rows" for one in sure}
        noise = {one.name: one.figures() for one in sure}
        found = {**self.stated, **self.adopted()}
        write_identified(Path(path), self.origin, found, noise, remarks)

    def adopted(self) -> dict[str, str | float]:
        """Return the adopted parameters for an experiment: texts with units."""
        return {
            one.name: f"{one.value:.5g} {one.unit}" if one.unit else round(one.value, 5)
            for one in self.parameters
            if one.adopted
        }

    def __str__(self) -> str:
        return "\n".join(self.lines())

    def lines(self) -> list[str]:
        """Return the report, line by line."""
        lines = [f"{self.name}: {self.length:.1f} s, {self.rows} rows"]
        rows = [("parameter", "was", "is", "95 % interval")]
        sentences: list[str] = []
        for one in self.parameters:
            if one.adopted:
                low, high = one.value - one.half, one.value + one.half
                between = f"{low:.4g} to {high:.4g}"
                rows.append(
                    (one.name, one.text(one.before), one.text(one.value), between)
                )
            else:
                sentences.append(f"{one.name} stays {one.text(one.before)}: {one.why}.")
        lines += aligned(rows) if len(rows) > 1 else []
        lines += _wrapped(sentences)
        errors = [
            (path, _shown(self.before[path], unit), _shown(self.after[path], unit))
            for path, unit in self.units.items()
            if path in self.before
        ]
        if errors:
            lines.append(
                f"prediction over {self.seconds:.1f} s that were not used, root mean "
                "square"
            )
            lines += aligned([("error of", "was", "is"), *errors])
        lines += _wrapped(
            [
                *(f"Note: {note}." for note in self.notes),
                *map(str, self.noise),
                *(f"Drive next: {one}." for one in self.suggestions[:1]),
            ]
        )
        if taken := self.adopted():
            words = ", ".join(f"{_key(n)} = {_text(v)}" for n, v in taken.items())
            lines.append("Write this to the robot in the experiment's file:")
            lines.append(f"  parameters = {{ {words} }}")
        else:
            lines.append("The parameters as they are predict best; change nothing.")
        return lines


def _wrapped(sentences: Iterable[str]) -> list[str]:
    """Return lines that fit a terminal."""
    return [
        line
        for sentence in sentences
        for line in wrap(sentence, WIDE, subsequent_indent="  ")
    ]


def _shown(value: float, unit: str) -> str:
    """Return a small value with a unit that people read."""
    factor, unit = {"m": (1e3, "mm"), "rad": (180 / pi, "deg")}.get(unit, (1.0, unit))
    return f"{value * factor:.3g} {unit}".strip()


def _key(name: str) -> str:
    """Return a name as a key of TOML."""
    return f'"{name}"' if "/" in name else name


def _text(value: str | float) -> str:
    """Return a value as TOML has it."""
    return f'"{value}"' if isinstance(value, str) else f"{value:g}"
