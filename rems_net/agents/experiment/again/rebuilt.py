"""Rebuilt: the experiment of a recording, as it was or with changes."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PureWindowsPath
from typing import Any

from rems_net.agents import registry
from rems_net.agents.about.outside import HOLD, PUT, Outside
from rems_net.agents.agent import Agent
from rems_net.agents.experiment import origins
from rems_net.agents.experiment.again.changed import (
    agent_of,
    known,
    replace_in,
    set_in,
)
from rems_net.agents.experiment.again.replayed import haunt, nested, played
from rems_net.agents.experiment.experiment import Experiment
from rems_net.agents.protocol.plan import Plan, class_names, each, usual_sources
from rems_net.agents.verbs import CALLED, CALLS, verb_names
from rems_net.errors import ExperimentError, RemsError
from rems_net.recordings.manifest import Manifest, read_manifest
from rems_net.recordings.mcap.reader import McapFile


@dataclass
class Rebuilt:
    """The experiment of a recording.

    lab: without its outputs.  recorder: the plan of the output that recorded it.
    played: keys of agents that play their recording, each with the reason.
    """

    file: McapFile
    told: Manifest
    lab: Experiment
    recorder: Plan
    played: dict[str, str] = field(default_factory=dict)
    #: by key of an agent that is computed: the calls from outside, in their order
    outside: dict[str, list[Outside]] = field(default_factory=dict)

    @property
    def last(self) -> int:
        """The last tick in the file."""
        end = max((one.end for one in self.file.chunks), default=0)
        return round(end / 1e9 / self.told.dt)

    def set(self, where: str, value: object) -> None:
        """Change a setting, such as `robot/sim.track`. Raises ExperimentError."""
        self._known(agent_of(self.lab, where) or where.partition(".")[0])
        set_in(self.lab, where, value)

    def replace(self, key: str, name: str) -> None:
        """Give an agent another class of the same kind. Raises ExperimentError."""
        self._known(key)
        replace_in(self.lab, key, name)

    def only(self, key: str) -> None:
        """Compute one agent; all others play their recording. Raises ExperimentError.

        With a robot in a world, the world and the other robots in it are computed.
        """
        here = self._known(key)
        for one in [*self.lab.plans.values()]:
            if one is here or (here.world and one.world == here.world):
                continue
            del self.lab.plans[one.key]
            if one.key not in self.played:
                self.played[one.key] = f"only {key} is computed"
            if (plan := played(one, self.file)) is not None:
                self.lab.plans[one.key] = plan
        self.call()
        haunt(self.lab.plans, self.played, self.file)

    def call(self) -> None:
        """Let robots act upon the calls of processes that play their recording."""
        calls = [
            key
            for key, schema in self.file.schemas.items()
            if schema.digest == CALLS.digest and key.rpartition("/")[0] in self.played
        ]
        for plan in self.lab.plans.values():
            if plan.kind == "robot" and plan.key not in self.played:
                plan.sources |= {f"{CALLED}/{key}": key for key in calls}

    def _known(self, key: str) -> Plan:
        if key in self.played:
            raise ExperimentError(
                f"{key} plays its recording ({self.played[key]}), so it cannot be "
                "changed; change an agent that is computed. (R0436)"
            )
        return known(self.lab, key)

    def check(self) -> dict[str, Agent]:
        """Build all agents. Raises ExperimentError for ports that have changed."""
        self._check_ports(self.lab.build())  # before what reads them
        agents = self.lab.check()
        self._check_ports(agents, settled=True)
        return agents

    def _check_ports(
        self, agents: Mapping[str, Agent], *, settled: bool = False
    ) -> None:
        """Raise ExperimentError for a port unlike the recording's.

        settled: whether ports are known that depend on connections.
        """
        for key, was in self.file.schemas.items():
            agent, _, port = key.rpartition("/")
            if agent in self.played:
                continue
            ports = agents[agent].published() if agent in agents else {}
            now = ports.get(port)
            if (settled and now is None) or (now and now.digest != was.digest):
                has = ", ".join(now.paths) if now else "no such port"
                raise ExperimentError(
                    f"{key} is not as in the recording, and cannot be compared: it "
                    f"had {', '.join(was.paths)}; now it has {has}, or other units or "
                    "ranges. (R0436)"
                )

    def repeat(self) -> None:
        """Let agents that are computed repeat what came from outside."""
        holds = [tuple(Outside(n - 1, HOLD, [on])) for n, on in self.file.holds()]
        for robot in self.lab.plans.values():
            if robot.kind == "robot" and robot.key not in self.played:
                robot.again = [*robot.again, *holds]
        for _, key, text in self.file.events():
            one, plan = Outside.read(text), self.lab.plans.get(key)
            if one is not None and plan is not None and key not in self.played:
                self.outside.setdefault(key, []).append(one)
                if not one.lost:
                    plan.again = [*plan.again, tuple(one)]

    def _not_repeated(self, agents: Mapping[str, Agent]) -> Iterator[str]:
        """Yield a sentence for each call from outside that is not repeated."""
        calls = [
            (one, key)
            for key, some in self.outside.items()
            if key not in self.played
            for one in some
        ]
        for one, key in sorted(calls, key=lambda call: call[0].n):
            where = f"{key}.{one.verb}() was called from outside after tick {one.n}"
            if one.lost:
                yield (
                    f"{where}, with arguments that no recording holds ({one.lost}): it "
                    "is not repeated, and what follows may differ."
                )
            elif one.verb != PUT and one.verb not in verb_names(type(agents[key])):
                yield f"{where}, and there is no such verb here: it is not repeated."

    def differing(self, agents: Mapping[str, Agent]) -> Iterator[str]:
        """Yield a sentence for each source, data file or version that differs."""
        yield from self._not_repeated(agents)
        now = origins.digests(self.lab.plans, agents, self.lab.folder)
        for name, digest in self.told.sources.items():
            if name in now and now[name] != digest:
                yield f"{name} differs from the file of the recording."
            elif name not in now and not (self.lab.folder / name).is_file():
                yield f"{name} was used by the recording, and is not here."
        have = origins.versions(agents.values())
        for name in sorted(have.keys() | self.told.versions.keys()):
            was, here = self.told.versions.get(name), have.get(name)
            if was and here and was != here:
                yield f"{name} is {here} here; the recording was made with {was}."
        beside = read_manifest(self.file.path.parent)
        if beside is None or beside.agents != self.told.agents or len(have) == 1:
            return  # models without a library are the same on all machines
        here = origins.numerics(agents.values(), native=True)
        if beside.numerics != here:
            yield (
                f"The recording was computed with {beside.numerics}; here it is "
                f"{here}: last digits may differ."
            )


def rebuild(path: Path, folder: Path) -> Rebuilt:
    """Return the experiment of a recording. folder: where the user's files are.

    Raises ExperimentError for what is no recording, or cannot be built again.
    """
    file = McapFile(path)
    saved = file.told
    if not saved.agents or not saved.dt:
        raise ExperimentError(
            f"{path} has no experiment in it that could be done again; an output of "
            "type mcap writes such a file. (R0436)"
        )
    if not any(file.counts.values()):
        raise ExperimentError(
            f"{path} has no values in it to be compared; record the run "
            "with an output of type mcap. (R0436)"
        )
    lab = Experiment(saved.experiment, dt=saved.dt, seed=saved.seed, folder=folder)
    mcap = registry.load(registry.BUILT_IN["output"]["mcap"], folder)
    recorder = Plan("output", "recorder", [mcap], sources=usual_sources(mcap))
    made = Rebuilt(file, saved, lab, recorder)
    lab.duration = made.last * saved.dt
    for kind, table in each(saved.agents):
        plan = _plan(kind, table, lab)
        if kind == "output":
            if plan is not None and mcap in plan.classes:
                made.recorder = plan
            continue
        assert plan is not None
        if why := _played(plan.classes):
            made.played[plan.key] = why
            if (plan := played(plan, file)) is None:
                continue
        lab.plans[plan.key] = plan
    made.call()
    haunt(lab.plans, made.played, file)
    made.repeat()
    return made


def _played(classes: Sequence[type]) -> str:
    """Return why an agent of these classes plays its recording; "" if it does not."""
    last = classes[-1]
    if getattr(last, "by_hand", False):
        return "a person moves it"
    if not all(getattr(one, "lockstep", True) for one in classes):
        return f"{last.__name__} lives in wall time"
    if any(getattr(one, "by_picture", False) for one in classes):
        return "pictures differ between machines"
    return ""


def _plan(kind: str, table: Mapping[str, Any], lab: Experiment) -> Plan | None:
    """Return the plan of a table; None for an output other than a recorder.

    Raises ExperimentError for a class that is gone.
    """
    try:
        key, names = f"{kind}/{table['name']}", class_names(kind, table)
        if kind == "world":
            ghosts = table.get("options", {}).get("ghosts", ())
            names += [one["definition"] for one in ghosts]
        if kind == "output" and names != [registry.BUILT_IN["output"]["mcap"]]:
            return None
        for name in names:
            file = PureWindowsPath(name.rpartition(":")[0])  # of any system
            if file.name == "__main__":
                raise ExperimentError(
                    f"its class {name} was in no file; put it into one, and record it."
                    " (R0436)"
                )
            if file.drive or file.root or ".." in file.parts:
                raise ExperimentError(
                    f"{name} is not below the folder of the recording's experiment, so "
                    "it is "
                    "not run; take a recording of your own. (R0436)"
                )
        plan = Plan.read(kind, nested(kind, table, lab.folder), lab.folder, lab.dt)
    except RemsError as error:
        raise ExperimentError(
            f"{key} cannot be made again in {lab.folder.resolve()}: {error}"
        ) from None
    except (KeyError, TypeError, AttributeError) as error:
        raise ExperimentError(
            f"the recording is damaged: it describes an agent by {table!r:.80} "
            f"({type(error).__name__}). (R0436)"
        ) from None
    plan.restart = 0
    return plan
