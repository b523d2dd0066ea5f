"""A program that drives one emulated robot ahead, until it is killed.

`python -m tests.drivers.hardware.host KIND WHERE`: a kind of `kinds.py`, a port or URL.
"""

import sys

from tests.drivers import alone
from tests.drivers.hardware.kinds import KINDS


def main() -> None:
    kind = KINDS[sys.argv[1]]
    where = {"port" if kind.at_port else "url": sys.argv[2]}
    with alone.opened(kind.robot("b", options=where)) as robot:
        alone.keep_for(robot, kind.ahead, 60.0)


if __name__ == "__main__":
    main()
