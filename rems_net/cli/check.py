"""`rems check EXPERIMENT.toml`: everything that is checked before a run, and no run."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

from rich.console import Console
from rich.padding import Padding
from rich.table import Table

from rems_net.agents import registry
from rems_net.agents.agent import Agent
from rems_net.agents.experiment.checking.settings import check_pace
from rems_net.agents.experiment.experiment import Experiment
from rems_net.agents.experiment.file import load, located
from rems_net.agents.ports import In
from rems_net.agents.protocol.plan import Plan
from rems_net.cli.script import no_words, place, run_script
from rems_net.cli.words import add_experiment, console, show_schema
from rems_net.errors import ExperimentError, RemsError

EXAMPLES = """\
examples:
  rems check lab.toml
  rems check weave.py

A script is run up to its first run(), and no further. The exit status is 0
for an experiment that can be started, and 2 for one that cannot.
"""


def add(parser: argparse.ArgumentParser) -> None:
    """What `rems check` can be told."""
    add_experiment(parser)


def run(args: argparse.Namespace) -> int:
    """Check it, and say what would run."""
    path: Path = args.experiment
    if path.suffix == ".py":
        show(console(args), *from_script(path, args.words))
        return 0
    no_words(args)
    experiment = load(path)
    with located(path):
        agents = experiment.check()
        ticks = experiment.ticks(agents)
    show(console(args), experiment, agents, ticks, experiment.pace)
    return 0


Checked = tuple[Experiment, dict[str, Agent], int, float]


def from_script(path: Path, words: list[str]) -> Checked:
    """The experiment that a script would run first. Raises ExperimentError."""
    try:
        run_script(path, words, registry.end_script)
    except registry.ScriptEnd as end:
        experiment, pace = end.args
        try:
            factor = experiment.pace if pace is None else check_pace(pace)
            agents = experiment.check()
            return experiment, agents, experiment.ticks(agents), factor
        except RemsError as error:
            raise ExperimentError(f"{place(path, end)}: {error}") from None
    raise AssertionError("a script without a run() has been refused")


def show(
    out: Console,
    experiment: Experiment,
    agents: dict[str, Agent],
    ticks: int,
    pace: float,
) -> None:
    """Say in some lines what would run."""
    dt = experiment.dt
    speed = f"{pace:g} x real time" if pace else "as fast as possible"
    some = "1 agent" if len(agents) == 1 else f"{len(agents)} agents"
    out.print(
        f"{experiment.name} can run: {some}, {ticks * dt:g} s in {ticks} ticks of "
        f"{dt:g} s, {speed}."
    )
    for key, agent in agents.items():
        plan = experiment.plans[key]
        out.print()
        out.print(f"{key}  {', '.join(_traits(plan, dt))}")
        table = Table.grid(padding=(0, 2, 0, 0))
        ports, schemas = agent.ports(), agent.schemas()
        for port in dict.fromkeys([*ports, *schemas]):  # a world's are its things
            schema = schemas.get(port)
            takes = isinstance(ports.get(port), In)
            if schema is None and not takes:
                continue
            said = show_schema(schema) if schema else "whatever is there"
            if takes:
                source = plan.sources.get(port)
                said += f"  <- {source or 'any program'}"
            table.add_row("in" if takes else "out", port, said)
        out.print(Padding(table, (0, 0, 0, 2), expand=False))


def _traits(plan: Plan, dt: float) -> Iterator[str]:
    """What an agent is, and how it differs from most."""
    yield " done by ".join(cls.__name__ for cls in plan.classes)
    if plan.every > 1:
        yield f"every {plan.every} ticks"
    if plan.since > 1:
        yield f"from {(plan.since - 1) * dt:g} s on"
    if plan.host != plan.key:
        yield f"in host {plan.host}"
    if plan.machine:
        yield f"on machine {plan.machine}"
