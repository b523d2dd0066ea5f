"""Known: markers at known places, from which to find where a camera is."""

from collections.abc import Sequence
from math import degrees

import numpy as np

from rems_net.bodies.marker import Marker
from rems_net.bodies.parts import Array
from rems_net.eyes.finder import Finder, Target, on_floor
from rems_net.eyes.place import FEWEST, angles, place_of

#: px. If known markers are further than this from where they must be seen, the camera
#: is placed anew.
MOVED = 1.0
#: px. If they still are after that, their places or sizes are not as they are written.
WRONG = 1.0


class Known:
    """Markers that lie at known places: `at` is that of the marker, in the world."""

    def __init__(self, markers: Sequence[Marker]):
        self.markers = markers

    def place(self, finder: Finder) -> str:
        """Place the finder's view by the markers of its last picture, if it is off.

        Returns a sentence if it was off; "" if all is well, or too few are seen.
        """
        seen = [m for m in self.markers if (m.family, m.id) in finder.seen]
        if len(seen) < FEWEST:
            return ""
        points = np.concatenate([_points(one) for one in seen])
        pixels = np.concatenate([finder.seen[m.family, m.id] for m in seen])
        there, _ = finder.view.project(points)
        away = finder.view.straightened(pixels) - there
        if float(np.sqrt((away**2).mean())) <= MOVED:
            return ""
        view, left = place_of(finder.view, points, pixels)
        x, y, z = view.eye
        heading, pitch, roll = (degrees(one) for one in angles(view.turn))
        where = (
            f"place = {{ x = {x:.4f}, y = {y:.4f}, z = {z:.4f}, "
            f'heading = "{heading:.2f} deg", pitch = "{pitch:.2f} deg", '
            f'roll = "{roll:.2f} deg" }}'
        )
        if left > WRONG:
            odd = _worst(seen, points, pixels, finder).id
            return (
                f"{len(seen)} markers at known places do not fit together by "
                f"{left:.1f} px, marker {odd} least: measure their places and sizes"
            )
        finder.view = view
        return f"by {len(seen)} markers at known places, the camera has {where}"


def _points(marker: Marker) -> Array:
    return on_floor(Target("", marker, marker.at[2]), np.zeros(3))


def _worst(
    seen: Sequence[Marker], points: Array, pixels: Array, finder: Finder
) -> Marker:
    """Return the marker without which the others fit together best."""
    left = []
    for number in range(len(seen)):
        own = slice(4 * number, 4 * number + 4)
        others = (np.delete(one, own, axis=0) for one in (points, pixels))
        left.append(place_of(finder.view, *others)[1])
    return seen[int(np.argmin(left))]
