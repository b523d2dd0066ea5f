"""Replayed: an experiment whose agents publish the values of a recording."""

from collections.abc import Container
from pathlib import Path

from rems_net.agents import registry
from rems_net.agents.agent import Agent
from rems_net.agents.experiment.experiment import Experiment
from rems_net.agents.protocol.plan import Plan, Table, class_names, ghost_sources
from rems_net.errors import ExperimentError
from rems_net.recordings.mcap.columns import agents_of
from rems_net.recordings.mcap.reader import McapFile

#: where the classes are that play a recording
REPLAY = "rems_net.inputs.replay"
#: kinds of agents that can be played; a world has no agent of its own to stand for it
PLAYED = ("input", "robot", "process")


def nested(kind: str, table: Table, folder: Path) -> Table:
    """Return the table of a recorded agent as it is written now.

    Older recordings have the options of an input, a process, an output or a world
    beside its name. Raises ExperimentError for a class that is gone.
    """
    if kind == "robot":
        return table
    cls: type[Agent] = registry.load(class_names(kind, table)[0], folder)
    own = cls.options.schema.entries.keys() - {*cls.ins(), "options"}
    flat = {word: table[word] for word in table if word in own}
    rest = {word: table[word] for word in table if word not in own}
    return {**rest, "options": flat} if flat else table


def played(plan: Plan, file: McapFile) -> Plan | None:
    """Return the plan of what plays the recording of an agent; None without values."""
    keys = [key for key in file.schemas if key.rpartition("/")[0] == plan.key]
    if not keys or plan.kind not in PLAYED:
        return None
    names = [f"{REPLAY}:{'__'.join([plan.kind, *(k.split('/')[2] for k in keys)])}"]
    if plan.kind == "robot":
        names = ["rems_net.agents.robot:Definition", f"{REPLAY}:Player"]
    return Plan(
        plan.kind,
        plan.name,
        [registry.load(name, Path()) for name in names],
        options={"file": file.path.resolve().as_posix(), "agent": plan.key},
        every=plan.every,
        host=plan.key,
        since=plan.since,
        folder=plan.folder,
    )


def haunt(plans: dict[str, Plan], away: Container[str], file: McapFile) -> None:
    """Let ghosts take their own recorded poses, if they follow agents that are played.

    An agent that lives in wall time is recorded when its values come, which may be
    another tick than the one in which the world read them. away: keys of these agents.
    """
    for world in [plan for plan in plans.values() if plan.kind == "world"]:
        ghosts, ports = [*world.options.get("ghosts", ())], []
        for number, ghost in enumerate(ghosts):
            writer = "/".join(ghost["follows"].split("/")[:2])
            if writer in away and f"{world.key}/{ghost['name']}" in file.schemas:
                ports.append(ghost["name"])
                follows = f"input/{world.name}.ghosts/{ghost['name']}"
                ghosts[number] = {**ghost, "follows": follows}
        if ports:
            cls = registry.load(f"{REPLAY}:{'__'.join(['input', *ports])}", Path())
            options = {"file": file.path.resolve().as_posix(), "agent": world.key}
            name = f"{world.name}.ghosts"
            plan = Plan(
                "input", name, [cls], options=options, host=name, folder=world.folder
            )
            plans[plan.key] = plan
            world.options = {**world.options, "ghosts": ghosts}
            world.sources = ghost_sources(world.options)


def replayed(path: Path) -> tuple[Experiment, list[str]]:
    """Return an experiment that plays a recording, and the keys that it cannot play.

    No class of the recorded experiment is needed. Raises ExperimentError for what is
    no recording, or has no values.
    """
    file = McapFile(path)
    keys = agents_of(file)
    if not file.told.dt or not keys:
        what = "no values" if file.told.dt else "no experiment"
        raise ExperimentError(
            f"{path} has {what} in it that could be replayed; an output of type mcap "
            "writes such a file. (R0847)"
        )
    end = max(one.end for one in file.chunks) / 1e9
    lab = Experiment(
        file.told.experiment, dt=file.told.dt, duration=end, pace=1.0, record=False
    )
    for key in keys:
        kind, _, name = key.partition("/")
        # All in one process: what is computed is next to nothing.
        if (plan := played(Plan(kind, name, []), file)) is not None:
            plan.host, plan.every = "replay", 1
            lab.plans[key] = plan
    return lab, [key for key in keys if key not in lab.plans]
