"""Finder: the poses of known markers in one camera's pictures, and doubts."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rems_net.bodies.marker import Marker
from rems_net.bodies.parts import Array
from rems_net.eyes.drawn import ARUCO, found
from rems_net.eyes.plane import SPARE, Sighting, corners, sight
from rems_net.eyes.view import View

#: px. Standard deviation of an edge that is assumed before any was measured, and the
#: number of measured ones that it counts as.
FIRST, COUNTS = 0.1, 1.0
#: Number of measured deviations that are kept in mind: older ones fade.
MEMORY = 2000.0
#: sightings that are averaged for the size
SIZES = 20


class Sizes(NamedTuple):
    """Limits for a family's markers; sizes are shares of what is written.

    usual: of a marker that is as it is written; OpenCV's corners lie 2 % inside
    printed: deviation of the mean from which on it is reported
    foreign: deviation of a marker that is none of ours, such as one on a screen
    bent: px. If its edges deviate by more, a marker is not level, is partly covered, or
        is seen by another lens. OpenCV's corners deviate more.
    """

    usual: float = 1.0
    printed: float = 0.015
    foreign: float = 0.25
    bent: float = 0.6


#: Families of which one square in 330 with random cells is a marker. Theirs count from
#: their second picture in a row on, and have to have their size.
WEAK = {ARUCO: Sizes(0.98, 0.035, 0.1, 1.0)}
STRONG = Sizes()


@dataclass(frozen=True, slots=True)
class Target:
    """A marker that is looked for: its owner's name, and its height, m."""

    name: str
    marker: Marker
    height: float


@dataclass(frozen=True, slots=True)
class Found:
    """Pose of a target: (3,), x and y in m, heading in rad; and its covariance."""

    target: Target
    pose: Array
    covariance: Array


#: a doubt: its kind, the id it is about, and a sentence
Doubt = tuple[str, int, str]


@dataclass
class Finder:
    """Finds targets by id; measures how much edges deviate, and the markers' sizes."""

    view: View
    targets: Mapping[int, Target]
    #: squares of deviations, px2, and their number
    squares: float = COUNTS * FIRST**2
    count: float = COUNTS
    #: measured sizes of each marker, as shares of what is written
    sizes: dict[int, list[float]] = field(default_factory=dict)
    #: corners (4, 2) of each marker in the last picture, by family and id
    seen: dict[tuple[str, int], Array] = field(default_factory=dict)
    #: families and ids that count, of those in the last picture
    sure: list[tuple[str, int]] = field(default_factory=list)
    #: families and ids that are searched twice: all at first, then those just seen
    expected: set[tuple[str, int]] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.expected = {(t.marker.family, t.marker.id) for t in self.targets.values()}

    @property
    def deviation(self) -> float:
        """Standard deviation of an edge, as measured so far, px."""
        return float((self.squares / self.count) ** 0.5)

    def look(self, grey: NDArray[np.uint8]) -> tuple[list[Found], list[Doubt]]:
        """Return the targets in a picture (height, width), and what is doubtful."""
        last, self.seen, twice = self.seen, {}, set()
        for family in sorted({one.marker.family for one in self.targets.values()}):
            missing = {n for of, n in self.expected if of == family}
            four = found(family, grey, missing)
            often = Counter(number for number, _ in four)
            for number, pixels in four:
                target = self.targets.get(number)
                if target is None or target.marker.family != family:
                    continue
                if often[number] > 1:
                    twice.add(number)
                else:
                    self.seen[family, number] = pixels
        self.expected = {*self.seen}
        self.sure = [one for one in self.seen if one[0] not in WEAK or one in last]
        poses, doubts = self.place()
        return poses, [
            *(("twice", number, _TWICE) for number in sorted(twice)),
            *doubts,
        ]

    def place(self) -> tuple[list[Found], list[Doubt]]:
        """Return the targets of the last picture by the view as it is now."""
        sightings, doubts = [], []
        for family, number in self.sure:
            target = self.targets[number]
            pixels = self.seen[family, number]
            one = sight(self.view, target.marker, target.height, pixels)
            if doubt := self._doubt(target, one):
                doubts.append((doubt[0], number, doubt[1]))
            elif one is not None:
                sightings.append((target, one))
        self._learn([one for _, one in sightings])
        doubts += self._odd_sizes(sightings)
        square = self.squares / self.count
        return [Found(t, one.pose, one.spread * square) for t, one in sightings], doubts

    def _doubt(self, target: Target, one: Sighting | None) -> tuple[str, str] | None:
        """Return why a sighting cannot be used, if it cannot."""
        marker, height = target.marker, 1e3 * target.height
        if one is None:
            return "plane", (
                f"is seen at or above the horizon, and not {height:.0f} mm above the "
                "floor: is the camera's place right?"
            )
        sizes = WEAK.get(marker.family, STRONG)
        share = one.scale / sizes.usual
        if abs(share - 1) > sizes.foreign:
            return "foreign", (
                f"is {share:.0%} of its size of {1e3 * marker.size:.0f} mm if it lies "
                f"{height:.0f} mm above the floor; it is passed over. Is it a picture "
                "of a marker, lies it elsewhere, or has the camera another lens?"
            )
        if (one.misfit / SPARE) ** 0.5 > sizes.bent:
            return "bent", (
                "does not fit a square that lies level; it is passed over. Is it bent, "
                "tilted or partly covered, or has the camera another lens?"
            )
        return None

    def _learn(self, sightings: list[Sighting]) -> None:
        for one in sightings:
            self.squares += one.misfit
            self.count += SPARE
        if self.count > MEMORY:
            self.squares *= MEMORY / self.count
            self.count = MEMORY

    def _odd_sizes(self, sightings: list[tuple[Target, Sighting]]) -> Iterator[Doubt]:
        for target, one in sightings:
            marker = target.marker
            sizes = WEAK.get(marker.family, STRONG)
            known = self.sizes.setdefault(marker.id, [])
            known.append(one.scale / sizes.usual)
            if len(known) < SIZES:
                continue
            share = sum(known) / len(known)
            known.clear()
            if abs(share - 1) > sizes.printed:
                yield (
                    "size",
                    marker.id,
                    f"measures {1e3 * share * marker.size:.1f} mm, {share:.0%} of the "
                    f"{1e3 * marker.size:.0f} mm that is written: measure what the "
                    f"printer made, whether it lies {1e3 * target.height:.0f} mm above "
                    "the floor, and whether the lens is the camera's",
                )


def mirrored(grey: NDArray[np.uint8], families: set[str]) -> bool:
    """Return whether a picture shows markers only if it is turned left to right."""
    turned = np.ascontiguousarray(grey[:, ::-1])
    return any(found(family, turned) for family in sorted(families))


def on_floor(target: Target, pose: Array) -> Array:
    """Return the corners (4, 3) of a target whose owner has this pose."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    flat = corners(target.marker) @ np.array([[c, s], [-s, c]]) + pose[:2]
    return np.column_stack([flat, np.full(4, target.height)])


_TWICE = "is in the picture twice; neither is used. Print each id once"
