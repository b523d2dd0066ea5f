"""run.json: what a run says of its folder, beside the files of its outputs.

It holds nothing that differs from one run of an experiment to the next.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rems_net.reading import read_file

NAME = "run.json"
#: bytes of the longest that is read
LONGEST = 100_000_000


@dataclass(frozen=True)
class Start:
    """Where one robot started, and what stands around it.

    time: s      state: heading ("state/x [m]") to value      arena: radius, m; 0: none
    outline: what it covers of the floor in its own frame, "x,y x,y ..." in m; "" if
    nobody knows      world: name of the world that it is in; "" for none
    """

    time: float
    state: Mapping[str, float]
    arena: float = 0.0
    outline: str = ""
    world: str = ""


@dataclass(frozen=True)
class Manifest:
    """What a run wrote of itself.

    experiment: its name      robots: by name
    files: that its outputs made; while it runs, those that are expected
    seed: what the random numbers of its agents came from
    numerics: what it was computed with, in words
    agents: by kind, as in an experiment's file; without where each of them lived
    worlds: outlines of what stood in each world at the start, by name, as a robot's
    dt: seconds of a tick; 0 if it is not known
    ticks: that the experiment lasts; 0 if it has no end of its own
    sources: SHA-256 of the user's sources and data files, by their relative names
    versions: of rems_net, and of the libraries that the agents need
    """

    experiment: str = ""
    robots: Mapping[str, Start] = field(default_factory=dict)
    files: Sequence[str] = ()
    seed: int = 0
    numerics: str = ""
    agents: Mapping[str, Sequence[Mapping[str, Any]]] = field(default_factory=dict)
    worlds: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    dt: float = 0.0
    ticks: int = 0
    sources: Mapping[str, str] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)

    def plain(self) -> dict[str, Any]:
        """Return it as plain data."""
        return vars(self) | {"robots": {n: vars(one) for n, one in self.robots.items()}}

    def write(self, folder: Path) -> None:
        """Put it into the folder. Raises OSError."""
        text = json.dumps(self.plain(), indent=1, default=bytes.hex) + "\n"
        (folder / NAME).write_text(text, encoding="utf-8")


def read_manifest(folder: Path) -> Manifest | None:
    """What the run that wrote into `folder` says; None where there is no such word."""
    try:
        return parsed(json.loads(read_file(folder / NAME, LONGEST)))
    except (OSError, ValueError, RecursionError):
        return None


def parsed(told: Any) -> Manifest | None:
    """Return what a run says, from plain data; None for anything else."""
    try:
        robots = {
            str(name): Start(
                float(one["time"]),
                {str(k): float(v) for k, v in one["state"].items()},
                float(one["arena"]),
                str(one.get("outline", "")),
                str(one.get("world", "")),
            )
            for name, one in told.get("robots", {}).items()
        }
        files = [str(name) for name in told.get("files", [])]
        if any(Path(n).is_absolute() or ".." in Path(n).parts for n in files):
            return None  # a run names only what is in its folder
        seed = int(told.get("seed", 0))
        numerics = str(told.get("numerics", ""))
        agents = {str(k): list(v) for k, v in told.get("agents", {}).items()}
        worlds = {str(w): dict(things) for w, things in told.get("worlds", {}).items()}
        ticks = int(told.get("ticks", 0))
        sources = {str(k): str(v) for k, v in told.get("sources", {}).items()}
        versions = {str(k): str(v) for k, v in told.get("versions", {}).items()}
        name, dt = str(told["experiment"]), float(told.get("dt", 0.0))
        return Manifest(
            name,
            robots,
            files,
            seed,
            numerics,
            agents,
            worlds,
            dt,
            ticks,
            sources,
            versions,
        )
    except (ValueError, KeyError, TypeError, AttributeError):
        return None
