"""Direct: an experiment in this process, by the engine alone."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from rems_net.agents.agent import Agent
from rems_net.agents.experiment.checking.settings import count_ticks
from rems_net.agents.experiment.run import Result
from rems_net.agents.experiment.show import Show
from rems_net.agents.protocol.plan import Plan
from rems_net.engine.solo import Member, Solo
from rems_net.errors import ExperimentError
from rems_net.events import Event, listening


def members(
    plans: Mapping[str, Plan], agents: Mapping[str, Agent], *, outputs: bool
) -> dict[str, Member]:
    """Return what an engine needs of these agents. outputs: whether it writes files."""
    return {
        key: Member(agents[key], plan.sources, plan.since)
        for key, plan in plans.items()
        if outputs or plan.kind != "output"
    }


def check_direct(plans: Iterable[Plan], pace: float) -> None:
    """Raise ExperimentError for what one process cannot do."""
    if pace:
        raise ExperimentError(
            f"a direct run is as fast as it can be, and this one has pace = {pace:g}; "
            'leave direct out, or set pace = "fast".'
        )
    for plan in plans:
        what = "machine" if plan.machine else "restart" if plan.restart else ""
        if what:
            raise ExperimentError(
                f"{plan.key} has {what}, and a direct run is one process on one "
                f"laptop; leave {what} or direct out."
            )


def run_direct(
    build: Callable[[int], Mapping[str, Member]],
    dt: float,
    ticks: int,
    folder: Path,
    *,
    seed: int,
    show: Show,
) -> Result:
    """Make all ticks in this process. Raises AgentError for an agent that fails."""
    engine = Solo(build, dt, ticks, seed=seed)

    def pass_on(event: Event) -> None:
        event = replace(event, agent=event.agent or "run", tick=event.tick or engine.n)
        show.say("run", event)

    try:
        with listening(pass_on), engine:
            engine.run()
    except KeyboardInterrupt as error:
        error.add_note(
            f"Interrupted after tick {engine.n} ({engine.t:.2f} s); what the outputs "
            f"had written is in {folder}."
        )
        raise
    return Result(engine.n, folder, [Path(file) for file in engine.files])


def ticks_of(duration: float | None, dt: float, ends: list[float]) -> int | None:
    """Return after how many ticks an engine's run ends; None for no end."""
    return count_ticks(duration, dt, ends) if duration or ends else None
