"""Microseconds of a step of 0.1 s of each robot with each driver; `--quick`: of few."""

from __future__ import annotations

import json
import sys

from rems_net.testing.cells import cells
from rems_net.testing.matrix import speed

if __name__ == "__main__":
    only = ["woodbot"] if "--quick" in sys.argv else []
    found = {}
    for cell in cells(only):
        if cell.subject is not None and not cell.driven:
            found[cell.name] = 1e6 / speed(cell.subject)
    print(json.dumps(found))
