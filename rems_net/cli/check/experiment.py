"""`rems check EXPERIMENT.toml`: the checks before a run, and the first ticks."""

import argparse
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.padding import Padding
from rich.table import Table

from rems_net.agents import registry
from rems_net.agents.agent import Agent
from rems_net.agents.experiment.checking.harmless import Harmless
from rems_net.agents.experiment.checking.surroundings import doubts
from rems_net.agents.experiment.checking.trial import try_first_ticks
from rems_net.agents.experiment.direct import check_direct, check_fast
from rems_net.agents.experiment.experiment import Experiment
from rems_net.agents.experiment.source.mistakes import idle
from rems_net.agents.ports import In
from rems_net.agents.protocol.limits import check_pace
from rems_net.agents.protocol.plan import Plan
from rems_net.cli.options import console, show_schema, warn
from rems_net.cli.script import run_experiment
from rems_net.events import Event, listening

#: an experiment that can run: with its agents, its ticks and its pace
Checked = tuple[Experiment, dict[str, Agent], int, float]


def run(args: argparse.Namespace) -> int:
    """Check the experiment, and print what would run."""
    show(console(args), *first(Path(args.what), args.words))
    return 0


def check(experiment: Experiment, pace: float | str | None = None) -> Checked:
    """Check an experiment, and try its first ticks. Raises ExperimentError."""
    factor = check_pace(
        (experiment.pace or "fast") if pace is None else pace, experiment.dt
    )
    if experiment.direct:
        check_fast(factor)
    seen: set[str] = set()

    def report(event: Event) -> None:
        # The numerics are those of this process, not of a run.
        if event.kind != "numerics" and event.text not in seen:
            seen.add(event.text)
            warn(event.text)

    with listening(report):
        with Harmless():
            agents = experiment.check()
        if experiment.direct:
            drop = experiment.on_failure == "drop"
            check_direct(experiment.plans, agents, drop)
        ticks = experiment.ticks(agents)
        for text in doubts(agents):
            warn(text)
        rest = try_first_ticks(experiment, agents)
    if not factor and (sentence := idle(agents, experiment.plans)):
        warn(sentence)
    if rest:
        named = ", ".join(f"{key} ({why})" for key, why in rest.items())
        warn(f"not tried: {named}")
    return experiment, agents, ticks, factor


def first(path: Path, words: list[str]) -> Checked:
    """Check the experiment of a file, or the one that a script would run first.

    Raises ExperimentError.
    """
    found: list[Checked] = []

    def runner(experiment: Experiment, *_: Any, pace: Any = None, **__: Any) -> None:
        found.append(check(experiment, pace))
        raise registry.ScriptEnd

    with suppress(registry.ScriptEnd):
        run_experiment(path, words, runner)
    return found[0]


def show(
    out: Console,
    experiment: Experiment,
    agents: dict[str, Agent],
    ticks: int,
    pace: float,
) -> None:
    """Print in some lines what would run. pace: 0 for as fast as possible."""
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
        # a world has a port for each of its things
        for port in dict.fromkeys([*ports, *schemas]):
            schema, one = schemas.get(port), ports.get(port)
            takes = isinstance(one, In)
            if not schema and (schema is not None or not takes):
                continue
            if isinstance(one, In) and one.optional and not plan.reads(port):
                continue
            said = show_schema(schema) if schema else "every port that is there"
            if takes:
                sources = ", ".join(plan.reads(port))
                said += f"  <- {sources or 'any program'}"
            table.add_row("in" if takes else "out", port, said)
        out.print(Padding(table, (0, 0, 0, 2), expand=False))


def _traits(plan: Plan, dt: float) -> Iterator[str]:
    """Yield the class of an agent, and how it differs from most."""
    yield " done by ".join(cls.__name__ for cls in plan.classes)
    if plan.every > 1:
        yield f"every {plan.every} ticks"
    if plan.since > 1:
        yield f"from {(plan.since - 1) * dt:g} s on"
    if plan.host != plan.key:
        yield f"in host {plan.host}"
    if plan.machine:
        yield f"on machine {plan.machine}"
