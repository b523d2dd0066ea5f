"""Identify: which parameters fit a recording, and how much better it is then predicted.

A parameter is adopted only if a part of the drive that was not used is predicted better
with it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rems_net.agents.robot import Definition
from rems_net.errors import ExperimentError, nearest, some
from rems_net.identification.drive import Drive
from rems_net.identification.fit import SEGMENT, Fit, fit
from rems_net.identification.prediction import Predictor, cut, made
from rems_net.identification.result import Identified, Parameter

#: Share of the error on an unseen part that a parameter must take away.
GAIN = 0.02
#: Errors as small as this, in the field's unit, are rounding errors.
ROUND = 1e-9
#: Share of the error that is left if the recording is itself such a model.
MODEL = 0.1
#: Share of a parameter whose effect on the predictions is looked for.
CHANGE = 0.02
#: Share of a field's usual error that this change must cause to count as an effect.
EFFECT = 5e-5


def identify(
    drives: Sequence[Drive],
    definition: type[Definition],
    *,
    parameters: Mapping[str, Any] | None = None,
    names: Sequence[str] = (),
    check: Sequence[Drive] = (),
) -> Identified:
    """Fit the definition's parameters to drives, and test them on what was not used.

    parameters: as they were in the recordings      names: which to try; all that have
    an effect, if empty      check: drives that are only predicted; without them, each
    half of a drive is predicted from the others. Raises ExperimentError if nothing
    moves, a parameter does not exist, or a sign is turned round.
    """
    return _Search(drives, definition, parameters or {}, check).result(names)


class _Search:
    def __init__(
        self,
        drives: Sequence[Drive],
        definition: type[Definition],
        parameters: Mapping[str, Any],
        check: Sequence[Drive],
    ):
        self.drives, self.check = list(drives), list(check)
        self.robot = robot = made(definition, parameters)
        self.notes: list[str] = []
        self.units = {p: one.unit for p, one in robot.state.schema.rows()}
        self.numbers = {
            path: one
            for path, one in robot.parameters.schema.rows()
            if one.dtype == "float" and not one.shape
        }
        self.now = {name: float(robot.parameters[name]) for name in self.numbers}
        self.ranges = {
            name: (float(one.limits[0]), float(one.limits[1]))
            for name, one in self.numbers.items()
        }
        self.predictor = Predictor(definition, parameters)
        self._check_motion()

    def result(self, names: Sequence[str]) -> Identified:
        """Return the parameters that the unseen parts confirm."""
        for name in names:
            if name not in self.numbers:
                raise ExperimentError(
                    f"{self.predictor.definition.__name__} has no parameter {name!r} "
                    f"that is a number; it has {some(list(self.numbers))}."
                    f"{nearest(name, self.numbers)} (R0863)"
                )
        tried, idle = self._effective(list(names) or list(self.numbers))
        if not tried:
            raise ExperimentError(
                f"no parameter of {self.predictor.definition.__name__} changes what "
                "these recordings show; drive farther, and in curves. (R0860)"
            )
        self._find_model(tried)
        tried, blind = self._visible(tried)
        self.plain = before = self._unseen([])
        adopted, after = self._adopt(tried)
        best = self._fit(self.drives, adopted)
        every = self._fit(self.drives, tried)
        self._tell_jolts(best)
        found = []
        for name in [*tried, *blind, *(idle if names else ())]:
            took = best if name in adopted else every
            value = took.values.get(name, self.now[name])
            why = blind.get(name, idle.get(name, ""))
            one = Parameter(name, self.numbers[name].unit, self.now[name], value)
            one.half = took.half.get(name, 0.0)
            if not why and name not in adopted:
                why = "the unseen part is not predicted better with it"
            elif not why and one.text(one.value) == one.text(one.before):
                why = "it fits as it is"
            one.why, one.adopted = why, not why
            found.append(one)
        parts = [part for parts, _ in self._folds() for part in parts]
        seconds = float(np.mean([part.time[-1] - part.time[0] for part in parts]))
        first = self.drives[0]
        return Identified(
            first.name,
            len(first),
            float(first.time[-1] - first.time[0]),
            found,
            before,
            after,
            self.units,
            seconds,
            best.error,
            best.segments,
            self.notes,
        )

    # -- what the recordings show --------------------------------------------------

    def _check_motion(self) -> None:
        """Raise ExperimentError if nothing moves, or moves the wrong way."""
        went: dict[str, list[Any]] = {}
        for drive in self.drives:
            segments = cut([drive], drive.time[-1] - drive.time[0])
            starts = {p: read[:, 0] for p, read in segments.read.items()}
            off = self.predictor(segments, starts, {})
            for path, rows in zip(segments.read, off, strict=True):
                pair = went.setdefault(path, [[], []])
                pair[0].extend(np.diff(rows[0]))
                pair[1].extend(np.diff(segments.read[path][0]))
        if not any(np.abs(real).max() > 0 for _, real in went.values()):
            which = ", ".join(drive.name for drive in self.drives)
            raise ExperimentError(
                f"nothing moves in the recording of {which}. Record a drive in curves "
                "of both directions, with pauses. (R0860)"
            )
        for path in ("heading", *went):
            model, real = map(np.array, went.get(path, ([], [])))
            size = float(np.sqrt((model**2).sum() * (real**2).sum()))
            if path == "heading" and size and float((model * real).sum()) < -0.7 * size:
                raise ExperimentError(
                    f"{path!r} turns the other way than its command. Exchange "
                    "the left and the right motor, or turn the sign of what measures "
                    f"{path!r}; a wrong sign is not fitted. (R0864)"
                )

    def _effective(self, names: Sequence[str]) -> tuple[list[str], dict[str, str]]:
        """Return the names with an effect, and why the others have none."""
        segments = cut(self.drives, SEGMENT)
        starts = {p: read[:, 0] for p, read in segments.read.items()}
        plain = self.predictor(segments, starts, {})
        usual = np.sqrt(
            ((plain - np.array([*segments.read.values()])) ** 2).mean(axis=(1, 2))
        )
        tried, idle = [], {}
        for name in names:
            low, high = self.ranges[name]
            value = self.now[name]
            moved = value + CHANGE * (abs(value) or 1.0)
            moved = min(max(moved, low), high)
            if moved == value:
                moved = value - CHANGE * (abs(value) or 1.0)
            off = np.sqrt(
                ((self.predictor(segments, starts, {name: moved}) - plain) ** 2).mean(
                    axis=(1, 2)
                )
            )
            if (off > ROUND + EFFECT * usual).any():
                tried.append(name)
            else:
                idle[name] = "it has no effect on these drives"
        return tried, idle

    def _find_model(self, names: Sequence[str]) -> None:
        """Find out whether a model was recorded that makes one step of Euler a row."""
        fine = self._fit(self.drives, names)
        self.predictor.euler = True
        coarse = self._fit(self.drives, names)
        if all(coarse.error[p] <= MODEL * fine.error[p] + 1e-12 for p in fine.error):
            self.notes.append(
                "this is the recording of a model: each row is one step of Euler's "
                "rule, and is predicted so"
            )
        else:
            self.predictor.euler = False

    def _visible(self, names: list[str]) -> tuple[list[str], dict[str, str]]:
        """Return the names that can be separated, and why the others cannot."""
        names, blind = list(names), {}
        while len(names) > 1:
            ways = self._fit(self.drives, names).blind
            if not ways:
                break
            way = max(ways, key=len)
            mixed = sorted(way, key=names.index)
            out = mixed[0]
            names.remove(out)
            rest = " and ".join(name for name in mixed if name != out)
            blind[out] = (
                f"only its combination with {rest} shows; measure one of them"
                if rest
                else "these drives do not show it"
            )
        return names, blind

    def _tell_jolts(self, found: Fit) -> None:
        if found.jolts:
            when = ", ".join(f"{t:.0f}" for t in found.jolts[:5])
            self.notes.append(
                f"{len(found.jolts)} of {found.segments + len(found.jolts)} segments "
                f"do not fit and are left out (from {when} s): a jolt, a wall, or "
                "somebody has lifted the robot"
            )

    # -- what the unseen parts confirm ---------------------------------------------

    def _folds(self) -> list[tuple[list[Drive], list[Drive]]]:
        """Return pairs: drives that are only predicted, and drives to fit."""
        if self.check:
            return [(self.check, self.drives)]
        halves = [
            drive.part(rows)
            for drive in self.drives
            for rows in (slice(0, len(drive) // 2 + 1), slice(len(drive) // 2, None))
        ]
        return [
            ([one], [other for other in halves if other is not one]) for one in halves
        ]

    def _adopt(self, names: Sequence[str]) -> tuple[list[str], dict[str, float]]:
        """Return the names that make unseen parts better, one after the other."""
        adopted: list[str] = []
        errors = self.plain
        while rest := [name for name in names if name not in adopted]:
            tried = {name: self._unseen([*adopted, name]) for name in rest}
            best = min(rest, key=lambda name: self._size(tried[name]))
            if self._size(tried[best]) > (1 - GAIN) * self._size(errors):
                break
            adopted.append(best)
            errors = tried[best]
        together = (
            self._unseen(list(names)) if len(names) > len(adopted) + 1 else errors
        )
        if self._size(together) < (1 - GAIN) * self._size(errors):
            return list(names), together
        return [name for name in names if name in adopted], errors

    def _size(self, errors: Mapping[str, float]) -> float:
        """Return one number: the mean error as a share of that with nothing fitted."""
        shares = [(errors[p] + ROUND) / (self.plain[p] + ROUND) for p in errors]
        return float(np.mean(shares))

    def _unseen(self, names: Sequence[str]) -> dict[str, float]:
        """Return the RMS errors by field of free runs over parts that were not used."""
        total: dict[str, float] = {}
        rows = 0
        for unseen, seen in self._folds():
            values = self._fit(seen, names).values if names else {}
            for drive in unseen:
                off = self._free(drive, values)
                for path, errors in off.items():
                    total[path] = total.get(path, 0.0) + float((errors**2).sum())
                rows += len(drive)
        return {path: float(np.sqrt(square / rows)) for path, square in total.items()}

    def _free(self, drive: Drive, values: Mapping[str, float]) -> dict[str, Any]:
        """Return the errors (n,) of a free run; it starts from the first readings."""
        segments = cut([drive], drive.time[-1] - drive.time[0])
        starts = {path: read[:, 0] for path, read in segments.read.items()}
        run = self.predictor(segments, starts, values)
        return {
            path: rows[0] - segments.read[path][0]
            for path, rows in zip(segments.read, run, strict=True)
        }

    def _fit(self, drives: Sequence[Drive], names: Sequence[str]) -> Fit:
        begin = {name: self.now[name] for name in names}
        return fit(self.predictor, drives, begin, self.ranges)
