"""Changed: an experiment with another setting or class, as text names it."""

from collections.abc import Mapping
from typing import Any

from rems_net.agents import parts
from rems_net.agents.experiment.lineup import Lineup
from rems_net.agents.protocol.plan import ROBOT, SLOTS, Plan
from rems_net.agents.robot import Robot
from rems_net.errors import ExperimentError, nearest, some
from rems_net.scenes.marking import MARKER


def agent_of(lab: Lineup, where: str) -> str:
    """Return the key of the agent that `robot/sim.track` names; "" if there is none."""
    return next((key for key in lab.plans if where.startswith(f"{key}.")), "")


def set_in(lab: Lineup, where: str, value: object) -> None:
    """Change a setting, such as `robot/sim.track`. Raises ExperimentError."""
    key = agent_of(lab, where)
    if not key:
        key = known(lab, where.partition(".")[0]).key
        raise ExperimentError(
            f"{where!r} names no setting of {key}; expected such as {key}.track."
            " (R0436)"
        )
    path, plan = where[len(key) + 1 :], lab.plans[key]
    agent = plan.build()
    slots = {"options": agent.options.schema}
    if isinstance(agent, Robot):
        agent.prepare()
        slots["parameters"] = agent.parameters.schema
        slots["initial"] = agent.state.schema
        if plan.marker:
            slots["marker"] = MARKER
    for slot in (one for one in SLOTS if one in slots):
        if path in slots[slot].entries or path in slots[slot].paths:
            changed = _changed(getattr(plan, slot), path.split("/"), value)
            setattr(plan, slot, changed)
            return
    paths = (path for slot in SLOTS if slot in slots for path in slots[slot].paths)
    have = [*dict.fromkeys(paths)]
    raise ExperimentError(
        f"{key} has no setting {path!r}; it has {some(have) if have else 'none'}."
        f"{nearest(path, have)} (R0436)"
    )


def replace_in(lab: Lineup, key: str, name: str) -> None:
    """Give an agent another class of the same kind. Raises ExperimentError."""
    plan = known(lab, key)
    if plan.kind == "world":
        raise ExperimentError(
            f"{key} has no class of its own to be replaced; name a robot, an "
            "input or a process. (R0436)"
        )
    kinds = ROBOT[::-1] if plan.kind == "robot" else (plan.kind,)
    refused: list[ExperimentError] = []
    for kind in kinds:
        try:
            cls = parts.find(kind, name, lab.folder)
        except ExperimentError as error:
            refused.append(error)
        else:
            plan.classes[ROBOT.index(kind) if len(kinds) > 1 else 0] = cls
            return
    raise ExperimentError(f"{key} cannot have {name!r}: {refused[0]}")


def known(lab: Lineup, key: str) -> Plan:
    """Return the plan of an agent. Raises ExperimentError if there is none."""
    if key not in lab.plans:
        raise ExperimentError(
            f"there is no agent {key!r} in {lab.name}; there is "
            f"{', '.join(lab.plans)}.{nearest(key, lab.plans)} (R0436)"
        )
    return lab.plans[key]


def _changed(
    settings: Mapping[str, Any], path: list[str], value: object
) -> dict[str, Any]:
    first, *rest = path
    inner = settings.get(first)
    table = inner if isinstance(inner, Mapping) else {}
    return {**settings, first: _changed(table, rest, value) if rest else value}
