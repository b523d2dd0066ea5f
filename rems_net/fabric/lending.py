"""Lending: a robot of an open fabric moves to another one, and back."""

from __future__ import annotations

from collections.abc import Mapping

from rems_net.agents.protocol.messages import Loan
from rems_net.errors import ExperimentError, FabricError, WireError
from rems_net.fabric.client import Client, UnansweredError
from rems_net.router.keys import check_name, is_name
from rems_net.router.mail import Mail
from rems_net.router.message import read

#: seconds it may take to join another run
PATIENCE = 15.0


def lend(client: Client, robot: str, to: str, sources: Mapping[str, str]) -> str:
    """Lend a robot to the fabric `to`; raises FabricError with the reason."""
    return _ask(client, robot, Loan(check_name(to, "the fabric's name"), sources))


def take_back(client: Client, robot: str) -> str:
    """Have a robot come back; the fabric that it is on. Raises FabricError."""
    return _ask(client, robot, Loan("", {}))


def _ask(client: Client, robot: str, loan: Loan) -> str:
    kind, _, name = robot.rpartition("/")
    if kind != "robot" or not is_name(name):
        raise ExperimentError(
            f"{robot!r} is no robot; expected one, such as robot/woodbot-7."
        )
    was_there = client.is_there(robot)
    payload = loan.to_wire()
    try:
        return client.ask(f"{robot}/@lend", _read_fabric, "", payload, PATIENCE)
    except UnansweredError:
        if not was_there or not client.is_there("clock"):
            raise
    raise FabricError(
        f"At {client.session.link.endpoint}: {robot} "
        + (
            "can't be lent: it is part of a run. What can is a robot that was started "
            "by itself, by `rems agent robot`."
            if client.is_there(robot)
            else "has gone without an answer; whether it was lent is not known. If it "
            "comes back, `rems list` shows where it is: ask again."
        )
    )


def _read_fabric(mail: Mail) -> str:
    fabric = read(mail.payload)
    if not is_name(fabric):
        raise WireError("it is no fabric")
    return str(fabric)
