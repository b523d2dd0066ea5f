"""`python -m tests.agents.bringing MACHINE [FOLDER]`: another laptop, which says yes.

Machine b of a run at REMS_ROUTER, whose own code is in FOLDER.
"""

import os
import subprocess
import sys
from pathlib import Path

from rems_net.agents.experiment.placement.bring import Asked, serve_run
from rems_net.agents.experiment.placement.receiving import Wanted
from rems_net.agents.experiment.show import Show
from rems_net.errors import RemsError
from rems_net.router.find import open_session

ROOT = Path(__file__).parents[2]


def bring(here: Path, machine: str = "b", router: str = "") -> subprocess.Popen[str]:
    """Start it, below `here`, at REMS_ROUTER or at `router`."""
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(
        [sys.executable, "-m", __name__, machine, str(here)],
        env=env | ({"REMS_ROUTER": router} if router else {}),
        stderr=subprocess.PIPE,
        text=True,
    )


def agree(_: Asked) -> None:
    """Agree to whatever is asked."""


def main(machine: str, here: Path) -> int:
    """Bring what the first run asks for; the exit status."""
    try:
        with open_session() as session:
            run = Wanted(session, machine, "").next()
            serve_run(run, machine, here, Show(), agree)
    except RemsError as error:
        print(f"rems: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1], Path(*sys.argv[2:3])))
