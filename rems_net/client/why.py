"""Reasons, in sentences, why a value does not come or is old."""

import json
import math
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

from rems_net.client.answers import NONSENSE
from rems_net.client.client import NOBODY, Client
from rems_net.client.stopping import standings
from rems_net.defdict import Schema
from rems_net.errors import ExperimentError, nearest
from rems_net.router.asking import printable
from rems_net.router.mail import Mail

#: s. A longer time without a tick, of the run or of a member, is reported.
LONG = 1.0
#: what a board reports as its class
FIRMWARE = "Woodbot's firmware"


def why(
    client: Client, key: str, rows: list[dict[str, Any]], schemas: dict[str, Schema]
) -> Iterator[str]:
    """Yield sentences about the port `key` of an agent, or about all its ports.

    rows: the roster.  schemas: of the ports of the agent. Raises ExperimentError for a
    port that it does not have.
    """
    kind, name, *rest = key.split("/")
    agent, port = f"{kind}/{name}", rest[0] if rest else ""
    told = client.ask(f"{agent}/@why", _read)
    ports = list(dict.fromkeys([*schemas, *told["ins"]]))
    if port and port not in ports:
        raise ExperimentError(
            f"{agent} has no port {port!r}; it has {', '.join(ports)}."
            f"{nearest(port, ports)} (R0620)"
        )
    yield from _of_time(client, agent, rows)
    if told["board"]:
        yield from _of_board(client, agent)
    for each in [p for p in ports if port in ("", p, p.partition("/")[0])]:
        if each in told["ins"]:
            yield from _of_in(f"{agent}/{each}", told, told["ins"][each])
        elif not told["tick"]:
            yield f"{agent}/{each} has not been written yet: it has made no tick."
        else:
            yield (
                f"{agent}/{each} was written at tick {told['tick']} "
                f"({told['time']:.2f} s), the newest that {agent} has made."
            )


def _of_time(client: Client, agent: str, rows: list[dict[str, Any]]) -> Iterator[str]:
    """Yield what holds the clock, or this agent."""
    clock = client.ask("clock/@why", _read_clock, NOBODY)
    n, age = clock["tick"], clock["age"]
    if clock["paused"]:
        yield f"The clock is paused after tick {n}. Type: rems clock resume"
    elif age > LONG and clock["waits_for"]:
        yield f"Tick {n} has been held for {age:.1f} s by {clock['waits_for']}."
    if clock["stopped"]:
        yield "STOP holds, until `rems stop --release`."
    if agent.startswith("robot/"):
        robot = agent.partition("/")[2]
        for receipt in standings(client.session, robot, holds=clock["stopped"]):
            yield f"{receipt}."
    for row in rows:
        if row["agent"] == agent and row["seen"] > LONG and not clock["paused"]:
            where = client.session.ask(client.session.key(agent, "@where"), first=True)
            line = where[0].payload.decode(errors="replace") if where else ""
            at = f"; it stands at {printable(line)}" if where else ""
            yield (
                f"{agent} on {row['host']} has made no tick for {row['seen']:.1f} s"
                f"{at}."
            )


def _of_board(client: Client, agent: str) -> Iterator[str]:
    """Yield how a robot's own clock differs from the fabric's, by its own estimate."""
    with suppress(*NONSENSE):
        found = client.call(agent, "figures", (), {})
        offset, delay = _number(found["offset"]), _number(found["delay"])
        yield (
            f"{agent} received the newest tick at most {1000 * delay:.0f} ms after it "
            f"was made; its own clock is {abs(offset):.3f} s "
            f"{'behind' if offset < 0 else 'ahead of'} the fabric's time."
        )


def _of_in(key: str, told: dict[str, Any], port: dict[str, Any]) -> Iterator[str]:
    source = port["source"]
    who = f"from {source}" if source else "from a program outside"
    if port["heard"] is None:
        hint = "" if source else f" It takes a value that any program puts at {key}."
        yield f"Nothing that fits has come at {key} {who} yet.{hint}"
    else:
        old = max(0.0, told["time"] - port["heard"])
        yield (
            f"{key} has the value {who} at {port['heard']:.2f} s, {old:.2f} s of "
            "fabric time ago."
        )
        if old > port["max_age"]:
            robot, _, share = key.partition("/command")
            does = "obeys the safe values of its fields" if share else "stands still"
            yield (
                f"{robot} {does}: that is older than the {port['max_age']:g} s for "
                "which it obeys a command."
            )
    for count, reason in port["reasons"]:
        yield f"{key} has dropped {count} x: {reason}"


def _read(mail: Mail) -> dict[str, Any]:
    """Return what an agent reports of its Ins. Raises for a malformed answer."""
    told = json.loads(mail.payload)
    ins = {
        printable(port): {
            "source": printable(one["source"]),
            "heard": None if one["heard"] is None else _number(one["heard"]),
            "max_age": _number(one.get("max_age", 1e9)),
            "reasons": [(int(n), printable(said)) for n, said in one["reasons"]],
        }
        for port, one in told["ins"].items()
    }
    return {
        "tick": int(told["tick"]),
        "time": _number(told["time"]),
        "ins": ins,
        "board": list(told.get("made_of", ()))[:1] == [FIRMWARE],
    }


def _read_clock(mail: Mail) -> dict[str, Any]:
    told = json.loads(mail.payload)
    return {
        "tick": int(told["tick"]),
        "age": _number(told["age"]),
        "paused": bool(told["paused"]),
        "stopped": bool(told["stopped"]),
        "waits_for": printable(told["waits_for"]),
    }


def _number(value: Any) -> float:
    number = float(value)
    if not math.isfinite(number):
        raise ValueError("no number")
    return number
