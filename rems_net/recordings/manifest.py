"""run.json: description of a run, beside the files of its outputs.

It contains nothing that differs between two runs of the same experiment.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rems_net.reading import read_file

NAME = "run.json"
#: bytes of the longest file that is read
LONGEST = 100_000_000


@dataclass(frozen=True)
class Start:
    """Start of one robot, and its surroundings.

    time: s      state: heading ("state/x [m]") to value      arena: radius, m; 0: none
    outline: its footprint in its own frame, "x,y x,y ..." in m; "" if unknown
    world: name of its world; "" for none
    """

    time: float
    state: Mapping[str, float]
    arena: float = 0.0
    outline: str = ""
    world: str = ""


@dataclass(frozen=True)
class Manifest:
    """Description of a run, written by the run.

    experiment: its name      robots: by name
    files: made by its outputs; while it runs, the expected ones
    seed: of the random numbers of its agents
    numerics: the mathematics used, in words
    agents: by kind, as in an experiment's file; without their machines
    worlds: outlines of the things in each world at the start, by name, as a robot's
    """

    experiment: str = ""
    robots: Mapping[str, Start] = field(default_factory=dict)
    files: Sequence[str] = ()
    seed: int = 0
    numerics: str = ""
    agents: Mapping[str, Sequence[Mapping[str, Any]]] = field(default_factory=dict)
    worlds: Mapping[str, Mapping[str, str]] = field(default_factory=dict)

    def write(self, folder: Path) -> None:
        """Write it into the folder. Raises OSError."""
        plain = vars(self) | {
            "robots": {n: vars(one) for n, one in self.robots.items()}
        }
        text = json.dumps(plain, indent=1, default=bytes.hex) + "\n"
        (folder / NAME).write_text(text, encoding="utf-8")


def read_manifest(folder: Path) -> Manifest | None:
    """Read the manifest of the run in `folder`; None if there is none."""
    path = folder / NAME
    try:
        told = json.loads(read_file(path, LONGEST))
        robots = {
            str(name): Start(
                float(one["time"]),
                {str(k): float(v) for k, v in one["state"].items()},
                float(one["arena"]),
                str(one.get("outline", "")),
                str(one.get("world", "")),
            )
            for name, one in told["robots"].items()
        }
        files = [str(name) for name in told["files"]]
        if any(Path(n).is_absolute() or ".." in Path(n).parts for n in files):
            return None  # a run names only files in its folder
        seed = int(told.get("seed", 0))
        numerics = str(told.get("numerics", ""))
        agents = {str(k): list(v) for k, v in told.get("agents", {}).items()}
        worlds = {str(w): dict(things) for w, things in told.get("worlds", {}).items()}
        name = str(told["experiment"])
        return Manifest(name, robots, files, seed, numerics, agents, worlds)
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return None
