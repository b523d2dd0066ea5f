"""Identify: which parameters fit a recording, and how much better it is then predicted.

A parameter is adopted only if a part of the drive that was not used is predicted better
with it.
"""

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from rems_net.agents.robot import Definition
from rems_net.bodies.actuators import GROUP
from rems_net.errors import ExperimentError, nearest, some
from rems_net.identification.drive import Drive, without
from rems_net.identification.faults import check_clocks, check_motion, describe_jolts
from rems_net.identification.fit import SEGMENT, Fit, fit
from rems_net.identification.prediction import Predictor, cut, whole
from rems_net.identification.result import Identified, Parameter
from rems_net.identification.simulated import Simulated
from rems_net.identification.suggest import Suggestion, suggest as suggest_drives

#: Share of the error on an unseen part that a parameter must take away.
GAIN = 0.02
#: Ratio. If errors grow by it without a parameter, it is not left out later, either.
NEEDED = 1.5
#: Number of blocks; each is predicted from the others.
BLOCKS = 3
#: Errors as small as this, in the field's unit, are rounding errors.
ROUND = 1e-9
#: Share of the error that is left if the recording is itself such a model.
MODEL = 0.1
#: A gain is the share of a top speed, and shows only as the product with it.
GAINS = f"{GROUP}/gain/"
#: s, s, share. Where the search begins if these parameters are 0: there, a lag cannot
#: be separated from a delay.
BEGIN = {f"{GROUP}/lag": 0.06, f"{GROUP}/delay": 0.03, f"{GROUP}/dead_band": 0.03}
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
    suggest: bool = False,
    driver: str = "",
    progress: Callable[[str], None] | None = None,
) -> Identified:
    """Fit the definition's parameters to drives, and test them on what was not used.

    parameters: as they were in the recordings      names: which to try; all that have
    an effect, if empty      check: drives that are only predicted; without them, each
    third of a drive is predicted from the others      suggest: which drives would show
    more      driver: that predicts by simulation, such as mujoco      progress: gets a
    line now and then. Raises ExperimentError if nothing moves, a parameter does not
    exist, a sign is turned round, or clocks drift.
    """
    if driver and (suggest or not names):
        what = "leave out --suggest" if suggest else "name some: --fit mass,track"
        raise ExperimentError(
            f"simulations by {driver} are too slow to try all parameters, or 20 "
            f"drives; {what}. (R0882)"
        )
    base = dict(parameters or {})
    predictor = Predictor(definition, base)
    if driver:
        predictor = Simulated(definition, base, driver)
    search = _Search(drives, predictor, check, progress or (lambda line: None))
    found = search.result(names)
    if suggest:
        found.suggestions = search.suggestions(found)
    return found


class _Search:
    def __init__(
        self,
        drives: Sequence[Drive],
        predictor: Predictor,
        check: Sequence[Drive],
        progress: Callable[[str], None],
    ):
        self.given = self.drives = list(drives)
        self.check, self.progress = list(check), progress
        self.predictor, robot = predictor, predictor.plain
        self.notes: list[str] = []
        #: values to begin a search with: those of a fit of all parameters
        self.near: dict[str, float] = {}
        self._fits: dict[tuple[object, ...], Fit] = {}
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
        check_motion(self.predictor, self.drives)

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
        self._leave_out_jolts(tried)
        tried, blind = self._visible(tried)
        every = self._fit(self.drives, tried)
        check_clocks(every)
        self.near = every.values
        self.plain = before = self._unseen([])
        adopted, after = self._adopt(tried)
        best = self._fit(self.drives, adopted)
        found = []
        for name in [*tried, *blind, *(idle if names else ())]:
            took = best if name in adopted else every
            value = took.values.get(name, self.now[name])
            why = blind.get(name, idle.get(name, ""))
            one = Parameter(name, self.numbers[name].unit, self.now[name], value)
            one.half = took.half.get(name, 0.0)
            if not (why or name in adopted) and self._doubtful(name, took):
                why = "its interval holds this value"
            if not why and name not in adopted:
                why = "the unseen part is not predicted better with it"
            elif not why and one.text(one.value) == one.text(one.before):
                why = "it fits as it is"
            one.why, one.adopted = why, not why
            found.append(one)
        parts = [part for parts, _ in self._folds() for part in parts]
        seconds = float(np.mean([part.time[-1] - part.time[0] for part in parts]))
        first = self.given[0]
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

    def suggestions(self, found: Identified) -> list[Suggestion]:
        """Return short drives, the one first that shows most of what was tried."""
        values = {
            one.name: one.value or BEGIN.get(one.name, 0.0) for one in found.parameters
        }
        ranges, error = self.ranges, found.error
        self.progress("short drives are predicted")
        return suggest_drives(self.predictor, self.drives, values, ranges, error)

    # -- what the recordings show --------------------------------------------------

    def _effective(self, names: Sequence[str]) -> tuple[list[str], dict[str, str]]:
        """Return the names with an effect, and why the others have none."""
        segments = cut(self.drives, SEGMENT)
        starts = segments.starts()
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
        if not self.predictor.steps:
            return
        instant = [name for name in names if GROUP not in name]
        for part in (instant, names):
            self.predictor.euler = False
            fine = self._fit(self.drives, part).error
            self.predictor.euler = True
            coarse = self._fit(self.drives, part).error
            if all(coarse[p] <= MODEL * fine[p] + 1e-12 for p in fine):
                self.notes.append(
                    "this is the recording of a model: each row is one step of Euler's "
                    "rule, and is predicted so"
                )
                return
        self.predictor.euler = False

    def _visible(self, names: list[str]) -> tuple[list[str], dict[str, str]]:
        """Return the names that can be separated, and why the others cannot."""
        names, blind = list(names), {}
        while len(names) > 1:
            ways = self._fit(self.drives, names).blind
            if not ways:
                break
            # A gain shows only beside another one, or beside the top speed.
            longest = max(ways, key=lambda way: len(way))
            mixed = sorted(longest, key=names.index)
            out = next((name for name in mixed if GAINS in name), mixed[0])
            names.remove(out)
            rest = " and ".join(name for name in mixed if name != out)
            blind[out] = (
                f"only its combination with {rest} shows; measure one of them"
                if rest
                else "these drives do not show it"
            )
        return names, blind

    def _leave_out_jolts(self, names: Sequence[str]) -> None:
        """Leave out what does not fit, and split the rest into blocks."""
        found = self._fit(self.drives, names)
        left = without(self.drives, found.out)
        if found.jolts and left:
            self.notes.append(describe_jolts(found))
            self.drives = left
        self.blocks = [self.drives[i::BLOCKS] for i in range(BLOCKS)]
        if len(self.drives) == 1:
            (one,) = self.drives
            cuts = np.linspace(0, len(one), BLOCKS + 1).astype(int).tolist()
            ends = pairwise(cuts)
            self.blocks = [[one.part(slice(max(a - 1, 0), b))] for a, b in ends]

    # -- what the unseen parts confirm ---------------------------------------------

    def _folds(self) -> list[tuple[list[Drive], list[Drive]]]:
        """Return pairs: drives that are only predicted, and drives to fit."""
        if self.check:
            return [(self.check, self.drives)]
        blocks = [block for block in self.blocks if block]
        return [
            (block, [one for other in blocks if other is not block for one in other])
            for block in blocks
        ]

    def _adopt(self, names: Sequence[str]) -> tuple[list[str], dict[str, float]]:
        """Return the names without which unseen parts are predicted worse.

        The others are left out one after the other, the most useless first.
        """
        kept = list(names)
        errors = self._unseen(kept)
        needed: set[str] = set()
        while loose := [name for name in kept if name not in needed]:
            tried = {n: self._unseen([o for o in kept if o != n]) for n in loose}
            sizes = {name: self._size(one) for name, one in tried.items()}
            needed |= {n for n in loose if sizes[n] > NEEDED * self._size(errors)}
            out = min(loose, key=lambda name: sizes[name])
            if self._size(errors) < (1 - GAIN) * self._size(tried[out]):
                break
            kept.remove(out)
            errors = tried[out]
        sure = self._fit(self.drives, kept)
        clear = [name for name in kept if not self._doubtful(name, sure)]
        return clear, errors if clear == kept else self._unseen(clear)

    def _doubtful(self, name: str, found: Fit) -> bool:
        """Return whether a motor's fault may be none: its interval holds the value."""
        return GROUP in name and found.half[name] >= abs(
            found.values[name] - self.now[name]
        )

    def _size(self, errors: Mapping[str, float]) -> float:
        """Return one number: the mean error as a share of that with nothing fitted."""
        shares = [(errors[p] + ROUND) / (self.plain[p] + ROUND) for p in errors]
        return float(np.mean(shares))

    def _unseen(self, names: Sequence[str]) -> dict[str, float]:
        """Return the RMS errors by field of free runs over parts that were not used."""
        total: dict[str, float] = {}
        rows = 0
        for unseen, seen in self._folds():
            values = self._fit(seen, names, sure=False).values if names else {}
            for drive in unseen:
                off = self._free(drive, values)
                for path, errors in off.items():
                    total[path] = total.get(path, 0.0) + float((errors**2).sum())
                rows += len(drive)
        return {path: float(np.sqrt(square / rows)) for path, square in total.items()}

    def _free(self, drive: Drive, values: Mapping[str, float]) -> dict[str, Any]:
        """Return the errors (n,) of a free run; it starts from the first readings."""
        segments = whole(drive)
        run = self.predictor(segments, segments.starts(), values)
        return {
            path: rows[0] - segments.read[path][0]
            for path, rows in zip(segments.read, run, strict=True)
        }

    def _fit(
        self, drives: Sequence[Drive], names: Sequence[str], *, sure: bool = True
    ) -> Fit:
        """Return the fit of these parameters; each is made once.

        sure: whether it is a result, and not a step to one
        """
        key = sure, self.predictor.euler, tuple(names), *map(id, drives)
        if key not in self._fits:
            begin = {n: self.now[n] or BEGIN.get(n, 0.0) for n in names}
            begin |= {n: self.near[n] for n in names if n in self.near}
            self.progress(f"fit {len(self._fits) + 1}: {', '.join(names)}")
            found = fit(self.predictor, drives, begin, self.ranges, sure=sure)
            self._fits[key] = found
        return self._fits[key]
