"""Two recordings as one, in which each robot meets itself in the other run."""

from collections.abc import Collection, Iterator, Sequence
from copy import copy
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rems_net.errors import ExperimentError, some
from rems_net.recordings.recording import Recording, read

if TYPE_CHECKING:
    from rems_net.recordings.comparison import Pair, Trajectory
    from rems_net.recordings.differences import Difference
    from rems_net.recordings.manifest import Start
    from rems_net.recordings.parting.why import Why
    from rems_net.recordings.table import Columns


def together(one: Recording | Path | str, other: Recording | Path | str) -> Recording:
    """Return two runs as one recording, which compares each robot with itself.

    one, other: recordings, or their folders. `sim` of the second one is
    `sim (tuesday)`, by its folder. Raises ExperimentError if they share no robot.
    """
    return Together(*(x if isinstance(x, Recording) else read(x) for x in (one, other)))


class Together(Recording):
    """Recordings of two runs. `both["sim (tuesday)"]` is `sim` of the second one.

    one, other: the recordings; pictures are drawn into the folder of the first
    shared: the robots that both have
    Raises ExperimentError if there are none.
    """

    def __init__(self, one: Recording, other: Recording):
        super().__init__(one.folder, [*one.files, *other.files], one.like)
        self.one, self.other = one, other
        self.shared = [name for name in one if name in other]
        if not self.shared:
            raise ExperimentError(
                f"the recording in {one.folder} has {some([*one]) if one else 'none'}, "
                f"and that in {other.folder} {some([*other]) if other else 'none'}; "
                "two runs are compared by robots of the same name. (R0850)"
            )
        self._mark = mark(_names(one), _names(other))

    def marked(self, name: str) -> str:
        """Return the name of a robot of the second run."""
        return f"{name} ({self._mark})"

    def __iter__(self) -> Iterator[str]:
        for name in self.shared:
            yield from (name, self.marked(name))

    def __getitem__(self, robot: str) -> "Columns":
        """Return the columns of one robot. Raises UnknownFieldError."""
        name = robot.removesuffix(f" ({self._mark})")
        if name == robot or name not in self.shared:
            return self.one[robot]
        columns = copy(self.other[name])
        columns.name = robot
        return columns

    def trajectories(self, *only: str) -> "list[Trajectory]":
        """Return where the shared robots with x, y and heading drove, in both runs."""
        names = [name for name in self.shared if not only or name in only]
        first = {one.name: one for one in self.one.trajectories(*names)}
        second = {one.name: one for one in self.other.trajectories(*names)}
        found = []
        for name in names:
            if name in first and name in second:
                found += [first[name], replace(second[name], name=self.marked(name))]
        return found

    def pairs(self, robots: "Sequence[Trajectory]") -> "list[Pair]":
        """Return how far each robot is apart from itself in the other run."""
        by = {robot.name: robot for robot in robots}
        there = [name for name in self.shared if name in by]
        return [
            pair
            for name in there
            for pair in self.one.pairs([by[name], by[self.marked(name)]])
        ]

    def differences(self, posed: Collection[str], *only: str) -> "list[Difference]":
        """Return how far each robot is apart from itself by its state."""
        from rems_net.recordings.differences import differences

        found = (
            differences([self[name], self[self.marked(name)]], posed)
            for name in self.shared
            if not only or name in only
        )
        return [one for each in found for one in each]

    def start(self, robot: str) -> "Start | None":
        """Return where a robot started; None if its run has not recorded it."""
        name = robot.removesuffix(f" ({self._mark})")
        return (self.one if name == robot else self.other).start(name)

    def why(self, a: str = "", b: str = "") -> "Why":
        """Return where and why a robot, the first by default, parts in the second run.

        b: the robot that is compared with it instead.
        """
        a = a or self.shared[0]
        return super().why(a, b or self.marked(a))


def mark(one: Sequence[str], other: Sequence[str]) -> str:
    """Return the word by which the second recording differs from the first one."""
    words = (b for a, b in zip(one, other, strict=False) if a != b)
    return next(words, "second")


def _names(recording: Recording) -> list[str]:
    """Return the names of a recording, from its folder outwards; then of its file."""
    folder = recording.folder
    files: list[Path] = recording.tables()
    return [folder.name, *(file.stem for file in files[:1]), folder.parent.name]
