"""Trial: the first ticks of an experiment, in this process, before it is run."""

from collections.abc import Mapping
from copy import copy
from dataclasses import replace
from pathlib import Path
from threading import Event, Timer
from typing import Any

from rems_net.agents.agent import Agent
from rems_net.agents.experiment.checking.harmless import Harmless
from rems_net.agents.experiment.lineup import Lineup
from rems_net.agents.experiment.solo import Solo
from rems_net.agents.robot import Driver
from rems_net.errors import AgentError, ExperimentError

#: s. A check takes no longer than this for its ticks, however slow they are.
MOST = 1.0


def try_first_ticks(lineup: Lineup, agents: Mapping[str, Agent]) -> dict[str, str]:
    """Step every agent twice, so that each has read the values of the others.

    agents: those that `check` has built. Agents that would write a file or open a
    device are left out. Returns these, and why. Raises ExperimentError for a failure
    that a run would have, too. Warnings may come more than once.
    """
    away = {key: why for key, agent in agents.items() if (why := _elsewhere(agent))}
    if lineup.direct:  # such a run has them in its one process, or refuses them
        away = {}
    while True:
        try:
            with Harmless() as harmless:
                late = _step(_with_still(lineup, away), harmless.folder)
        except AgentError as error:
            new = harmless.refused.keys() - away.keys()
            if not new or (error.agent in agents and error.agent not in new):
                kind, _, name = error.agent.partition("/")
                raise ExperimentError(f"{kind} {name!r}: {error.cause}") from None
            away |= harmless.refused
            continue
        return {**dict.fromkeys(late, "joins later"), **harmless.refused, **away}


def _elsewhere(agent: Agent) -> str:
    """Return why an agent cannot be stepped in a check; "" if it can."""
    if not agent.lockstep:
        return "lives in real time"
    if isinstance(agent, Driver) and agent.one_per_process:
        return "needs another program"
    return ""


def _with_still(lineup: Lineup, away: Mapping[str, str]) -> Lineup:
    """Return the experiment with stand-ins, which do nothing, for these agents."""
    made = copy(lineup)
    made.plans = {}
    for key, plan in lineup.plans.items():
        classes = [*plan.classes]
        if key in away:
            classes[-1] = type(classes[-1].__name__, (_Still, classes[-1]), _AS_MODULE)
        made.plans[key] = replace(plan, classes=classes)
    return made


class _Still(Agent):
    """Never opens anything nor steps: its ports stay as they are."""

    lockstep = True
    one_per_process = False

    def open(self) -> None:
        """Acquire nothing."""

    def step(self, tick: object) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Release nothing."""

    def made(self) -> list[Path]:
        """Return no files."""
        return []

    @classmethod
    def swarm(cls, robots: Any) -> None:
        """Return None: robots step one after another."""


_AS_MODULE = {"__module__": __name__}


def _step(lineup: Lineup, folder: Path) -> list[str]:
    """Do the first ticks, in `MOST` seconds; return the agents that did not step."""
    over = Event()
    timer = Timer(MOST, over.set)
    with Solo(lineup, folder) as engine:
        plans = lineup.plans.values()
        firsts = [-(-plan.since // plan.every) * plan.every for plan in plans]
        last = max(firsts) + max(plan.every for plan in plans)
        timer.start()
        try:
            while engine.n < last and not over.is_set():
                engine.step()
        finally:
            timer.cancel()
        return [key for key in lineup.plans if not engine[key].tick.n]
