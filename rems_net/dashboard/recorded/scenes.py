"""Places and outlines for a recording, without a run.

Built-in definitions and worlds are built from the recorded experiment, and describe
themselves as in a run. A class of the user's is not loaded: a page on a recording runs
no code of others. Such a robot looks as the run has noted: its outline and its rays.
"""

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from rems_net.agents import registry
from rems_net.agents.about.scenery import scene_of
from rems_net.agents.world import World
from rems_net.recordings.comparison import corners
from rems_net.recordings.manifest import Manifest, Start

#: names of definitions that come with rems_net
OURS = frozenset(registry.BUILT_IN["definition"].values())
#: tables whose scenes are made; a page can draw no more
MOST = 200
Table = Mapping[str, Any]


def scenes_of(told: Manifest) -> dict[str, dict[str, Any]]:
    """Return the places and outlines of a recording's worlds and robots, by agent.

    Names of files, such as the MuJoCo model of a place, begin at the current folder.
    """
    found: dict[str, dict[str, Any]] = {}
    arenas: dict[str, dict[str, Any]] = {}
    for table in told.agents.get("robot", ())[:MOST]:
        name, world = str(table.get("name")), str(table.get("world", ""))
        scene = _robot(table, told.robots.get(name))
        if world:  # it has no arena of its own
            arenas.setdefault(f"world/{world}", scene.pop("arena", {}))
        found[f"robot/{name}"] = scene
    for table in told.agents.get("world", ())[:MOST]:
        key = f"world/{table.get('name')}"
        if table.get("options"):
            found[key] = _world(table, told)
        else:  # without settings it is the arena of its robots
            found[key] = arenas.get(key, {})
    return found


def _robot(table: Table, start: Start | None) -> dict[str, Any]:
    module, _, name = str(table.get("definition", "")).rpartition(":")
    found = {"made_of": name}
    for ours in OURS:
        room, _, named = ours.partition(":")
        if named != name or not f"{module}.".startswith(f"{room}."):
            continue
        with suppress(Exception):  # any file can name any settings
            cls: Any = registry.load(ours, Path())
            slots = {slot: table.get(slot) for slot in ("parameters", "initial")}
            robot = cls("recorded", **slots)
            robot.prepare()
            return found | scene_of(robot)
    return found | (_noted(start) if start is not None else {})


def _noted(start: Start) -> dict[str, Any]:
    """Return what the run has noted of a robot, in the form of `scenes/view.py`."""
    rays = [
        {"name": name, "at": ray[:3], "direction": ray[3:6], "reach": ray[6]}
        for name, ray in start.rays.items()
    ]
    found: dict[str, Any] = {"rays": rays, "outline": corners(start.outline).tolist()}
    return found if start.world else found | {"arena": {"radius": start.arena}}


def _world(table: Table, told: Manifest) -> dict[str, Any]:
    name = str(table.get("name"))
    with suppress(Exception):  # any file can name any settings
        options = dict(table["options"])
        ghosts = options.pop("ghosts", ())
        options["ghosts"] = [one for one in ghosts if one["definition"] in OURS]
        world = World(name, options=options)
        world.prepare()
        return scene_of(world)
    noted = told.worlds.get(name, {})
    return {"walls": [{"outline": corners(one).tolist()} for one in noted.values()]}
