"""run.json: description of a run, beside the files of its outputs.

It contains nothing that differs between two runs of the same experiment.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rems_net.defdict import DefDict, Schema
from rems_net.recordings.csv_file import heading
from rems_net.system.patience import patiently
from rems_net.system.reading import read_file

NAME = "run.json"
#: how many numbers a ray has
RAY = 7
#: bytes of the longest file that is read
LONGEST = 100_000_000


@dataclass(frozen=True)
class Start:
    """Start of one robot, and its surroundings.

    time: s      state: heading ("state/x [m]") to value      arena: radius, m; 0: none
    outline: its footprint in its own frame, "x,y x,y ..." in m; "" if unknown
    world: name of its world; "" for none
    rays: of its distance sensors, by the field with their value: x, y, z of the start
    in m, three numbers of the direction, and reach in m, in the robot's frame
    """

    time: float
    state: Mapping[str, float]
    arena: float = 0.0
    outline: str = ""
    world: str = ""
    rays: Mapping[str, Sequence[float]] = field(default_factory=dict)


@dataclass(frozen=True)
class Manifest:
    """Description of a run, written by the run.

    experiment: its name      robots: by name
    files: made by its outputs; while it runs, the expected ones
    seed: of the random numbers of its agents
    numerics: the mathematics used, in words
    agents: by kind, as in an experiment's file; without their machines
    worlds: outlines of the things in each world at the start, by name, as a robot's
    dt: s. Length of a tick; 0 if it is not known
    pace: real-time factor; 0 for as fast as possible
    ticks: of the experiment; 0 if it has no end of its own
    sources: SHA-256 of the user's sources and data files, by their relative names
    versions: of rems_net, and of the libraries that the agents need
    fields: paths of a schema in the order of its definition, by its digest; of those
    in alphabetical order there are none
    """

    experiment: str = ""
    robots: Mapping[str, Start] = field(default_factory=dict)
    files: Sequence[str] = ()
    seed: int = 0
    numerics: str = ""
    agents: Mapping[str, Sequence[Mapping[str, Any]]] = field(default_factory=dict)
    worlds: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    dt: float = 0.0
    pace: float = 0.0
    ticks: int = 0
    sources: Mapping[str, str] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)
    fields: Mapping[str, Sequence[str]] = field(default_factory=dict)

    def plain(self) -> dict[str, Any]:
        """Return it as plain data."""
        return vars(self) | {"robots": {n: vars(one) for n, one in self.robots.items()}}

    def initial(self, key: str, schema: Schema) -> DefDict:
        """Return the value of a port before its agent's first step.

        key: such as `robot/sim/state`. Of a state these are the robot's initial values;
        of any other port, the defaults.
        """
        value, (kind, name, port) = schema(), key.split("/")
        if (kind, port) == ("robot", "state") and name in self.robots:
            start = self.robots[name].state
            for path, one in schema.rows():
                known = start.get(heading(f"state/{path}", one.unit))
                if known is not None and one.dtype == "float" and not one.shape:
                    value[path] = known
        return value

    def first(self, key: str, dt: float) -> int:
        """Return the tick of an agent's first step; 0 if it is not known.

        key: of the agent.  dt: s.
        """
        kind, _, name = key.partition("/")
        for plan in self.agents.get(kind, ()):
            if plan.get("name") == name and dt:
                every = int(plan.get("every", 1))
                since = round(float(plan.get("since", 0.0)) / dt) + 1
                return -(-since // every) * every
        return 0

    def write(self, folder: Path) -> None:
        """Put it into the folder. Raises OSError."""
        text = json.dumps(self.plain(), indent=1, default=bytes.hex) + "\n"
        path = folder / NAME
        patiently(lambda: path.write_text(text, encoding="utf-8", newline="\n"))


def read_manifest(folder: Path) -> Manifest | None:
    """Return the manifest of the run that wrote into `folder`; None without one."""
    try:
        return parsed(json.loads(read_file(folder / NAME, LONGEST)))
    except (OSError, ValueError, RecursionError):
        return None


def parsed(told: Any) -> Manifest | None:
    """Return a manifest from plain data; None for anything else."""
    try:
        get = told.get
        found = Manifest(
            experiment=str(told["experiment"]),
            robots={str(name): _start(one) for name, one in get("robots", {}).items()},
            files=[*map(str, get("files", ()))],
            seed=int(get("seed", 0)),
            numerics=str(get("numerics", "")),
            agents={str(kind): list(some) for kind, some in get("agents", {}).items()},
            worlds={str(w): dict(things) for w, things in get("worlds", {}).items()},
            dt=float(get("dt", 0.0)),
            pace=float(get("pace", 0.0)),
            ticks=int(get("ticks", 0)),
            sources={str(k): str(v) for k, v in get("sources", {}).items()},
            versions={str(k): str(v) for k, v in get("versions", {}).items()},
            fields={str(k): [*map(str, v)] for k, v in get("fields", {}).items()},
        )
    except (ValueError, KeyError, TypeError, AttributeError):
        return None
    # A run names only files in its folder.
    outside = (Path(n).is_absolute() or ".." in Path(n).parts for n in found.files)
    return None if any(outside) else found


def _start(told: Any) -> Start:
    rays = told.get("rays", {}).items()
    return Start(
        time=float(told["time"]),
        state={str(k): float(v) for k, v in told["state"].items()},
        arena=float(told["arena"]),
        outline=str(told.get("outline", "")),
        world=str(told.get("world", "")),
        rays={str(path): [*map(float, ray)] for path, ray in rays if len(ray) == RAY},
    )
