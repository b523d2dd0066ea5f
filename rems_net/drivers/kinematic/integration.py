"""Integration: steps a state by its rates, and checks that steps are short enough."""

from collections.abc import Callable, Iterable, Mapping
from math import ceil, inf, isfinite
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rems_net.agents.diagnosis import written
from rems_net.errors import SchemaError
from rems_net.events import warn

if TYPE_CHECKING:
    from rems_net.drivers.kinematic.model import Model

#: rates by path: the field's unit per second; of one robot, or arrays of many
Change = Mapping[str, Any]
#: Returns the state that the rates lead to in the given seconds.
Ahead = Callable[[Any, Change, float], Any]
#: substeps, if no integrator is stated
SUBSTEPS = 4
#: steps between two comparisons of a step with its halves; another comparison is made
#: when the command begins to change
EVERY = 64
#: Largest difference between a step and its halves, by integrator, as a share of the
#: rates: reached if the step is as long as one time constant, or two.
LIMITS = {"euler": 0.25, "rk4": 0.1}
#: Smaller changes of a field in a step, in its own unit, count as rounding errors.
LITTLE = 1e-9


class Comparison(NamedTuple):
    """A step, compared with two of half its length.

    apart: whether they disagree; for arrays, an array.
    path: of the field that disagrees most. whole,
    halves: change of that field in each, in its own unit.
    """

    apart: Any
    path: str = ""
    whole: float = 0.0
    halves: float = 0.0


class Integration:
    """The integrator of one robot, or of a swarm whose values are arrays.

    kind: "euler" or "rk4".  count: substeps.  told: the warning about long steps, or
    ""; after a warning, steps are no longer compared.
    """

    def __init__(self, robot: "Model", ahead: Ahead):
        self.robot, self.ahead, self.told = robot, ahead, ""
        kind = robot.options["integrator"]
        stated = getattr(robot, "integrator", "") if kind == "default" else kind
        self.kind, self.count = stated or "rk4", 1 if stated else SUBSTEPS
        if self.kind not in LIMITS:
            raise SchemaError(
                f"{type(robot).__name__} states integrator = {stated!r:.60}; expected "
                '"euler" or "rk4". (R0304)'
            )
        self.count = robot.options["substeps"] or self.count
        self._steps = 0
        self._command: Any = None
        self._changed: Any = False
        self._suspect: Any = False

    def mean(
        self, state: Any, command: Any, h: float, first: Change | None = None
    ) -> Change:
        """Return the mean rates over `h` seconds.

        first: the rates at the beginning, if they are known
        """
        rates, ahead = self.robot.rates, self.ahead
        first = rates(state, command) if first is None else first
        if self.kind == "euler":
            return first
        second = rates(ahead(state, first, h / 2), command)
        third = rates(ahead(state, second, h / 2), command)
        fourth = rates(ahead(state, third, h), command)
        return {
            path: (first[path] + 2 * (second[path] + third[path]) + fourth[path]) / 6
            for path in first
        }

    def disagrees(self, state: Any, command: Any, h: float, told: Any) -> Any:
        """Return whether two steps in a row disagree with their halves, or an array.

        told: the values of the command, to find out whether it has changed.  Two in a
        row, since a step that reaches a limit disagrees once.
        """
        self._steps += 1
        steady = self._changed is False and self._suspect is False
        changed = self._command is None or told != self._command
        if changed is False and steady and self._steps % EVERY:
            return False  # most steps of one robot
        if type(changed) is not bool:
            changed = changed.any(axis=0)
        due = (changed > self._changed) | self._suspect | (self._steps % EVERY == 0)
        self._command, self._changed = told, changed
        drawn = "random" in self.robot.__dict__  # random rates never repeat
        if drawn or not (due if type(due) is bool else due.any()):
            return False
        try:
            with np.errstate(all="ignore"):
                apart = self.compare(state, command, h).apart
        except Exception:  # the mathematics fails in a state that only halves reach
            apart = False
        before, self._suspect = self._suspect, apart & due
        return before & self._suspect

    def compare(self, state: Any, command: Any, h: float) -> Comparison:
        """Compare a step of `h` seconds with two of half of it."""
        rates = self.robot.rates
        first = rates(state, command)
        whole = self.mean(state, command, h, first)
        half = self.mean(state, command, h / 2, first)
        middle = self.ahead(state, half, h / 2).copy()  # its result may be reused
        then = rates(middle, command)
        rest = self.mean(middle, command, h / 2, then)
        found, most = Comparison(False), 0.0
        for group in self._alike(first):
            off = {p: abs(whole[p] - (half[p] + rest[p]) / 2) for p in group}
            far = _most(rate[p] for p in group for rate in (first, then))
            least = LITTLE * (1.0 + _most(state[p] for p in group))
            share = _most(off.values())
            apart = (share > LIMITS[self.kind] * far) & (h * share > least)
            found = found._replace(apart=found.apart | apart)
            share = float(np.max(share / (far + 1e-300)))
            if np.any(apart) and share > most:
                path = max(group, key=lambda p: float(np.max(off[p])))
                ends = whole[path], (half[path] + rest[path]) / 2
                most = share
                found = Comparison(found.apart, path, *(_largest(h * e) for e in ends))
        return found

    def tell(self, h: float, dt: float) -> None:
        """Warn that substeps of `h` seconds, of a step of `dt`, are too long."""
        robot = self.robot
        state, command = robot.state, robot.command
        path, whole, halves = self.compare(state, command, h)[1:]
        said = f"steps of {h:g} s are too long for {written(robot, 'derivative')}"
        count = 4 * self.count
        if path:
            unit = getattr(robot.state.schema.find(path), "unit", "")
            said += f": in one, {path!r} goes {whole:.3g} {unit}, in two halves "
            said += f"{halves:.3g} {unit}"
            if 0 < (tau := self._time_constant(path, h)) < inf:
                said += f"; a time constant is about {tau:.2g} s"
                count = max(ceil(2 * dt / tau - 1e-6), self.count + 1)
        words = "" if self.kind == "rk4" else '"integrator": "rk4", '
        shorter = f"{dt * self.count / count:.2g} s"
        self.told = (
            f'{said}; write options = {{{words}"substeps": {count}}}, '
            f'or dt = "{shorter}"'
        )
        warn("step", f"{robot.key}: {self.told}", robot.key)

    def _time_constant(self, path: str, h: float) -> float:
        """Return the seconds in which a field's rate would change by its own size.

        Rates of the same unit count together; infinite if they do not change.
        """
        rates, command, little = self.robot.rates, self.robot.command, 1e-4 * h
        first = dict(rates(self.robot.state, command))
        later = rates(self.ahead(self.robot.state, first, little), command)
        group = next(group for group in self._alike(first) if path in group)
        change = _most(later[p] - first[p] for p in group) / little
        return float(_most(first[p] for p in group) / change) if change else inf

    def _alike(self, rates: Change) -> Iterable[list[str]]:
        """Return the fields that have rates, grouped by unit."""
        groups: dict[str, list[str]] = {}
        find = self.robot.state.schema.find
        for path in rates:
            groups.setdefault(getattr(find(path), "unit", ""), []).append(path)
        return groups.values()

    def endless(self, path: str, rate: float, h: float) -> SchemaError:
        """Return the error for a field of the state that is infinite or NaN."""
        place = written(self.robot, "derivative")
        why = self.told or f"what {place} returns has no bound, or steps of {h:g} s "
        why += "" if self.told else "are too long for it"
        if not isfinite(rate) and not self.told:
            why = f"{place} returned {rate:g} for it"
        n = self.robot.tick.n
        return SchemaError(
            f"at tick {n}, {path!r} of the state is infinite: {why}. (R0305)"
        )


def _most(values: Iterable[Any]) -> Any:
    """Return the largest absolute value; for arrays, an array."""
    found: Any = 0.0
    for value in map(abs, values):
        larger = np.maximum if isinstance(value, np.ndarray) else max
        found = larger(found, value)
    return found


def _largest(values: Any) -> float:
    return float(values) if np.ndim(values) == 0 else float(np.abs(values).max())
