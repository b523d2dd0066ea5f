"""Direct: an experiment in this process, by the engine alone."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from rems_net.agents.agent import Agent, Output
from rems_net.agents.experiment.folder import Result, finish, note_end, own_folder
from rems_net.agents.experiment.lineup import Lineup
from rems_net.agents.experiment.show import Show
from rems_net.agents.experiment.solo import Solo
from rems_net.agents.protocol.plan import Plan
from rems_net.errors import ExperimentError
from rems_net.events import Event, listening


def check_direct(
    plans: Mapping[str, Plan], agents: Mapping[str, Agent], drop: bool = False
) -> None:
    """Raise ExperimentError for settings that need more than one process.

    drop: whether a run goes on without an agent that has failed.
    """
    if drop:
        raise ExperimentError(
            "a direct run ends with the first agent that fails; leave on_failure or "
            "direct out. (R0433)"
        )
    for key, plan in plans.items():
        what = "machine" if plan.machine else "restart" if plan.restart else ""
        if what:
            raise ExperimentError(
                f"{key} has {what}, and a direct run is one process on one laptop; "
                f"leave {what} or direct out. (R0433)"
            )
        if not agents[key].lockstep and not isinstance(agents[key], Output):
            raise ExperimentError(
                f"{key} drives a device, which lives in wall time: an engine steps "
                "models and simulations only. Run this experiment by lab.run(), or "
                "give the robot another driver. (R0433)"
            )


def check_fast(pace: float) -> None:
    """Raise ExperimentError for a direct run with a pace."""
    if pace:
        raise ExperimentError(
            f"a direct run is as fast as it can be, and this one has pace = {pace:g}; "
            'leave direct out, or set pace = "fast". (R0433)'
        )


def run_direct(
    lab: Lineup,
    out: Path | str | None,
    agents: Mapping[str, Agent],
    ticks: int,
    show: Show,
) -> Result:
    """Make all ticks in this process, with the outputs in a folder of the run's own.

    Raises AgentError for an agent that fails.
    """
    check_direct(lab.plans, agents, lab.on_failure == "drop")

    def pass_on(event: Event) -> None:
        event = replace(event, agent=event.agent or "run", tick=event.tick or engine.n)
        show.say("run", event)

    # It computes with the libraries of this process: `native`, or pinned by rems.
    with own_folder(lab, out, agents, show, native=True) as folder:
        # The agents are built again: outputs know their folder now.
        engine = Solo(lab, folder, ticks)
        try:
            with listening(pass_on), engine:
                try:
                    engine.run()
                except BaseException:
                    engine.sum_up(failed=True)
                    raise
                engine.sum_up(failed=False)
        except BaseException as error:
            note_end(error, engine.n, lab.dt, folder)
            raise
        result = Result(engine.n, folder, [Path(file) for file in engine.files])
        finish(folder, result)
    return result
