"""Many values of one schema at once: as a table of numbers, and back.

For a thousand robots in one process, where a method call for each value would cost
more than what is done with it.
"""

from collections import deque
from collections.abc import Iterable
from itertools import repeat
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rems_net.defdict.values.mapping import Leaves
from rems_net.defdict.values.value import DefDict

_leaves = attrgetter("_leaves")
_all = slice(None)


def gather(values: Iterable[DefDict]) -> NDArray[np.float64]:
    """The numbers of whole values of one schema: shape (values, fields)."""
    return np.array(list(map(_leaves, values)), dtype=np.float64)


def scatter(rows: Iterable[Leaves], values: Iterable[DefDict]) -> None:
    """Give each value the leaves of its row. Nothing is checked."""
    kept: map[Any] = map(list.__setitem__, map(_leaves, values), repeat(_all), rows)
    deque(kept, maxlen=0)
