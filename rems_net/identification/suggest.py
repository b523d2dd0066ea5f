"""Suggest: which of 20 short drives would show most of a robot's parameters.

A drive is predicted with the parameters as they were found, and with the errors that
the recording has shown, which grow with speed. From both follow the intervals that it
would give; the best drive makes them narrowest. Then its pieces are changed, as long as
that makes them narrower still. It is driven twice: one interval of few pieces is wide.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from rems_net.identification.drive import Drive, Floats
from rems_net.identification.fit import ROUGH, SEGMENT, Problem
from rems_net.identification.intervals import sandwich, student
from rems_net.identification.prediction import Predictor, Segments, cut

#: s. Length of a drive, which is driven twice, and of its rows.
LASTS, ROW = 10.0, 0.1
#: s. Times for which a command holds.
HOLDS = (0.3, 0.5, 0.8, 1.2)
#: Number of changes that are tried, and s, of the longest piece that is changed.
CHANGES, PIECE = 250, 0.8
#: Number of changes that are predicted together.
TOGETHER = 8
#: Shares of full speed that a side gets, in a random order.
KINDS = {
    "full speed ahead and back": (1.0, -1.0),
    "full speed ahead and back, and rests": (1.0, -1.0, 0.0),
    "full and half speed": (1.0, -1.0, 0.5, -0.5),
    "full speed, and slowly": (1.0, -1.0, 0.2, -0.2),
    "ahead, at full and half speed": (1.0, 0.5),
}

#: Number of times that the parts of the errors are weighed anew.
WEIGHED = 6
#: Least part of an error, as a share of the usual one, squared.
RARE = 1e-4

Commands = Mapping[str, Floats]
#: fields, rows, and the share that they get
Change = tuple[Sequence[str], slice, float]


@dataclass(frozen=True)
class Suggestion:
    """A short drive, and what it would show.

    name: in words      drive: its commands, and where they lead
    gain: ratio by which its intervals are narrower than the recording's
    room: m, the longest way across it
    """

    name: str
    drive: Drive
    gain: float
    room: float

    def __str__(self) -> str:
        return (
            f"{self.name}: {self.drive.time[-1]:.0f} s, intervals {self.gain:.1f} "
            f"times as narrow, in {self.room:.1f} m of room"
        )

    def table(self) -> str:
        """Return the commands as a CSV file that an input plays."""
        paths = list(self.drive.command)
        lines = [",".join(["time [s]", *(f"command/{p} [percent]" for p in paths)])]
        shares = np.array([self.drive.command[path] for path in paths]).T
        for i in range(1, len(shares)):
            if i + 1 == len(shares) or (shares[i] != shares[i + 1]).any():
                numbers = [self.drive.time[i], *100 * shares[i]]
                lines.append(",".join(f"{number:g}" for number in numbers))
        return "\n".join([*lines, ""])


def suggest(
    predictor: Predictor,
    drives: Sequence[Drive],
    values: Mapping[str, float],
    ranges: Mapping[str, tuple[float, float]],
    error: Mapping[str, float],
) -> list[Suggestion]:
    """Return all short drives, the one that shows most first.

    drives: that were recorded      values: of the parameters, as these drives show them
    ranges: of these      error: RMS by field of predictions over short pieces, in the
    field's unit
    """
    names = list(values)
    spans = {name: ranges[name] for name in names}

    def problem(some: Sequence[Drive]) -> Problem:
        read = [replace(d, state={p: d.state[p] for p in error}) for d in some]
        return Problem(predictor, cut(read, SEGMENT), spans)

    known = problem(drives)
    known.believe(error)
    theta = np.array([*values.values()])
    keep = np.ones(len(known.segments))
    theta = known.solve(theta, known.scales(theta), keep, ROUGH)
    errors = Errors.of(known, theta)
    (now,) = errors.widths([known], theta)
    found_values = dict(zip(names, theta.tolist(), strict=True))

    def look(names: Sequence[str], commands: Sequence[Commands]) -> list[Suggestion]:
        drives = _predicted(predictor, commands, found_values)
        ones = [problem([drive]) for drive in drives]
        for one in ones:
            one.sigma = known.sigma
        widths = errors.widths(ones, theta)
        gains = [float(np.exp(np.log(now / wide).mean())) for wide in widths]
        rooms = map(_room, drives)
        return [*map(Suggestion, names, drives, gains, rooms)]

    fields = [*drives[0].command]
    every = [*candidates(fields)]
    found = look([name for name, *_ in every], [command for *_, command in every])
    found.sort(key=lambda one: -one.gain)
    kinds = {name: kind for name, kind, _ in every}
    best, random = found[0], np.random.default_rng(len(found))
    shares = KINDS[kinds[best.name]]
    changes = [_change(random, best.drive.command, shares) for _ in range(CHANGES)]
    while changes:
        # The next ones are looked at together, which takes little longer than one. The
        # first that is better is kept; those after it then change that one.
        others = [_changed(best.drive.command, one) for one in changes[:TOGETHER]]
        tried = look([best.name] * len(others), others)
        better = [i for i, one in enumerate(tried) if one.gain > best.gain]
        if better:
            best = tried[better[0]]
        del changes[: better[0] + 1 if better else TOGETHER]
    rows = {path: values[1:] for path, values in best.drive.command.items()}
    twice = {path: np.r_[0.0, some, some] for path, some in rows.items()}
    return [*look([best.name], [twice]), *found[1:]]


def candidates(
    fields: Sequence[str],
) -> Iterator[tuple[str, str, dict[str, Floats]]]:
    """Yield name, kind and commands of short drives: each kind, held for each time."""
    rows = round(LASTS / ROW) + 1
    for number, (hold, kind) in enumerate(product(HOLDS, KINDS)):
        random = np.random.default_rng(number)
        command = {path: _held(random, KINDS[kind], hold, rows) for path in fields}
        yield f"{kind}, each side for about {hold:g} s", kind, command


def _change(
    random: np.random.Generator, command: Commands, shares: Sequence[float]
) -> Change:
    """Return a change of one side, or of all, to another share in one piece."""
    fields, rows = list(command), len(next(iter(command.values())))
    side = int(random.integers(len(fields) + 1))
    first = int(random.integers(1, rows))
    last = first + int(random.integers(1, round(PIECE / ROW)))
    share = shares[int(random.integers(len(shares)))]
    return fields[side : side + 1] or fields, slice(first, last), share


def _changed(command: Commands, change: Change) -> Commands:
    """Return commands with this change."""
    fields, rows, share = change
    found = {path: values.copy() for path, values in command.items()}
    for path in fields:
        found[path][rows] = share
    return found


def _held(
    random: np.random.Generator, shares: Sequence[float], hold: float, rows: int
) -> Floats:
    """Return shares that are held for 0.6 to 1.4 times `hold`; the first row rests."""
    found = [0.0]
    while len(found) < rows:
        share = shares[int(random.integers(len(shares)))]
        found += [share] * max(1, round(hold / ROW * random.uniform(0.6, 1.4)))
    return np.array(found[:rows])


def _predicted(
    predictor: Predictor, commands: Sequence[Commands], values: Mapping[str, float]
) -> list[Drive]:
    """Return drives with the states to which commands lead, from 0.

    commands: all of one length
    """
    time = ROW * np.arange(len(next(iter(commands[0].values()))), dtype=np.float64)
    state = {p: np.zeros(len(time)) for p in predictor.plain.state.schema.paths}
    drives = [Drive("suggested", time, {**one}, state) for one in commands]
    plan = cut(drives, time[-1])
    went = predictor(plan, plan.starts(), values)
    return [
        replace(drive, state=dict(zip(state, went[:, i], strict=True)))
        for i, drive in enumerate(drives)
    ]


def _room(drive: Drive) -> float:
    """Return the longest way across a drive's path, m; 0 if it has no place."""
    if not {"x", "y"} <= set(drive.state):
        return 0.0
    x, y = (np.ptp(drive.state[path]) for path in ("x", "y"))
    return float(np.hypot(x, y))


@dataclass(frozen=True)
class Errors:
    """Variances of errors: of the readings of each field, and of slips.

    A slip is a share by which a command acts more or less in one row. The error of a
    row is the noise of its reading, and what all slips before it have caused.

    read: (m,), as shares of the fields' usual errors      slip: as a share of 1
    """

    read: Floats
    slip: float

    @classmethod
    def of(cls, problem: Problem, theta: Floats) -> "Errors":
        """Return what makes the residuals of a recording most probable."""
        r, _, of_start = problem.slopes(theta, problem.scales(theta))
        m = of_start.shape[2]
        rest = np.linalg.qr(of_start, mode="complete")[0][:, :, m:].transpose(0, 2, 1)
        off = (rest @ r[..., None])[..., 0]
        back = rest.transpose(0, 2, 1)
        parts = [rest @ part @ back for part in _parts(problem, theta)]
        floor = np.full(len(parts), RARE)
        floor[-1] = RARE**2
        sizes = np.ones(len(parts))
        sizes[-1] = RARE
        for _ in range(WEIGHED):  # Fisher's scoring
            usual = sum(size * part for size, part in zip(sizes, parts, strict=True))
            weight = np.linalg.pinv(usual, hermitian=True)
            seen = (weight @ off[..., None])[..., 0]
            made = [weight @ part for part in parts]
            left = np.array(
                [[np.einsum("sij,sji->", one, two) for one in made] for two in made]
            )
            right = [np.einsum("si,sij,sj->", seen, part, seen) for part in parts]
            found = np.linalg.pinv(left) @ np.array(right)
            sizes = np.maximum(found, floor)
        return cls(sizes[:-1], float(sizes[-1]))

    def widths(self, problems: Sequence[Problem], theta: Floats) -> list[Floats]:
        """Return for each problem the half widths (p,) of the intervals to expect.

        They are shares of scales, computed as those of a fit are, from blocks, with
        these errors. The problems have equally many segments, of equal lengths.
        """
        drives = [drive for one in problems for drive in one.segments.drives]
        segments = cut(drives, SEGMENT)
        slopes = _slopes(problems, segments, theta)
        effects = _effects(problems, segments, theta)
        return [*map(self._widths, slopes, effects)]

    def _widths(self, slopes: tuple[Floats, Floats, Floats], effects: Floats) -> Floats:
        _, of_theta, of_start = slopes
        p = of_theta.shape[-1]
        q, _ = np.linalg.qr(of_start)
        free = of_theta - q @ (q.transpose(0, 2, 1) @ of_theta)
        # Beforehand, each parameter is known to about itself.
        before = np.eye(p)
        inverse = np.linalg.inv(np.einsum("srp,srq->pq", free, free) + before)
        _, freedom = sandwich(free, np.zeros(free.shape[:2]), inverse)
        pulls = free.reshape(len(free), -1, len(self.read), p)
        read = np.einsum("slfp,slfq,f->pq", pulls, pulls, self.read)
        slips = free.transpose(0, 2, 1) @ effects
        spread = before + read + self.slip * np.einsum("spk,sqk->pq", slips, slips)
        points = np.array([student(one) for one in freedom])
        found: Floats = points * np.sqrt(np.diag(inverse @ spread @ inverse))
        return found


def _parts(problem: Problem, theta: Floats) -> list[Floats]:
    """Return covariances (S, R, R) of the errors by size: of fields, and of slips."""
    weight = problem.segments.weight
    one = np.eye(len(problem.sigma))
    rows = weight[:, :, None] * one[:, None, None]  # (m, S, L + 1, m)
    read = [row.reshape(len(weight), -1)[:, :, None] for row in rows]
    (slips,) = _effects([problem], problem.segments, theta)
    whole = np.eye(slips.shape[1])
    return [*(whole * row for row in read), slips @ slips.transpose(0, 2, 1)]


def _slopes(
    problems: Sequence[Problem], segments: Segments, theta: Floats
) -> list[tuple[Floats, Floats, Floats]]:
    """Return the slopes of problems, whose segments are predicted together."""
    scales = [one.scales(theta) for one in problems]
    asked = [
        one.nudges(theta, scale) for one, scale in zip(problems, scales, strict=True)
    ]
    starts = np.concatenate([each for _, each in asked], axis=2)
    values = dict(zip(problems[0].names, asked[0][0].T, strict=True))
    found = problems[0].predictor.many(segments, starts, values)
    parts = np.split(found, len(problems), axis=2)
    return [
        one.divided(part - one.read[:, None], theta, scale)
        for one, part, scale in zip(problems, parts, scales, strict=True)
    ]


def _effects(
    problems: Sequence[Problem], segments: Segments, theta: Floats
) -> list[Floats]:
    """Return the effects (S, R, K) of a slip of 1 of each command in each row."""
    values = dict(zip(problems[0].names, theta.tolist(), strict=True))
    starts = np.concatenate([one.starts for one in problems], axis=1)
    found = problems[0].predictor.shaken(segments, starts, values)
    parts = np.split(found, len(problems), axis=2)
    return [
        one.shape(part).transpose(1, 2, 0)
        for one, part in zip(problems, parts, strict=True)
    ]
