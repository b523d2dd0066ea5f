"""`rems list`: who is on the fabric."""

import argparse
import json
from collections.abc import Iterator, Mapping
from typing import Any

from rems_net.agents.agent import PHASES
from rems_net.cli.options import add_at, console, plain_table
from rems_net.client import Fabric, join
from rems_net.client.people import people
from rems_net.client.stopping import standings, stop_that_holds
from rems_net.errors import FabricError, some
from rems_net.router.find import fabrics, on_each, open_session
from rems_net.router.gate.identity import identity
from rems_net.router.relay.people import Person

EXAMPLES = """\
examples:
  rems list
  rems list --json
  rems list --all             every fabric at the class's router
  rems list --people          who is in the class, and what they run
"""

#: agents of one person that are named
MOST = 4


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="for programs")
    parser.add_argument(
        "--all", action="store_true", help="all fabrics at a class's router"
    )
    parser.add_argument(
        "--people", action="store_true", help="who is in the class; of a team, its own"
    )
    add_at(parser)


def run(args: argparse.Namespace) -> int:
    """Print a line per agent: kind, host, rate, and when its last message came."""
    if args.people:
        return _show_people(args)
    with join(fabric=args.fabric, at=args.at) as fabric:
        agents = _of_all(fabric) if args.all else sorted(fabric.agents(), key=_order)
        drivers = {} if args.all else fabric.drivers()
        stops = [] if args.json else _stops(fabric, all_there=args.all)
        if not (args.all or args.json):
            stops = [*_standing(fabric, holds=bool(stops)), *stops]
        name = fabric.session.fabric
    for agent in agents:
        if driver := drivers.get(agent["agent"]):
            agent["driver"] = driver
    if args.json:
        print(json.dumps(agents, indent=2))
        return 0
    first = ["fabric"] if args.all else []
    right = "rate", "last seen"
    last = ["driver"] if any("driver" in agent for agent in agents) else []
    table = plain_table(*first, "agent", "kind", "host", *right, *last, right=right)
    for agent in agents:
        table.add_row(
            *(agent[column] for column in first),
            agent["agent"],
            agent["kind"],
            agent["host"],
            f"{agent['rate']:.1f} Hz",
            f"{agent['seen']:.1f} s ago",
            *(agent.get(column, "") for column in last),
        )
    if agents:
        console(args).print(table)
    else:
        where = "at this router" if args.all else f"on the fabric {name!r}"
        print(f"No agent is {where}. Type: rems agent start robot woodbot kinematic")
    for line in stops:
        print(line)
    return 0


def _stops(fabric: Fabric, *, all_there: bool) -> list[str]:
    """Return the STOP that holds here and its author, a line for each fabric."""
    session = fabric.session
    known = identity(session)
    names = fabrics(session) if all_there else [session.fabric]
    if known is not None and known.fabric not in names:
        names.append(known.fabric)  # its robots may be driven from here
    told = on_each(session, names, stop_that_holds)
    lines = []
    for name, stop in told.items():
        if stop and isinstance(stop, str):
            foreign = known is not None and known.team and name == known.fabric
            lines.append(stop + (" by a teacher." if foreign else "."))
    return lines


def _standing(fabric: Fabric, *, holds: bool) -> Iterator[str]:
    """Yield how many robots surely stand, and a line for each other or lost one."""
    receipts = standings(fabric.session, holds=holds)
    if holds and receipts:
        stand = sum(receipt.stands for receipt in receipts)
        yield f"{stand} of {len(receipts)} robots stand."
    for receipt in receipts:
        if receipt.standing.kind == "lost" or not receipt.stands:
            yield f"{receipt}."


def _show_people(args: argparse.Namespace) -> int:
    """Print a line for each laptop of each user, and the users who have not come."""
    with open_session(args.fabric, args.at) as session:
        found = people(session)
        known = identity(session)
    if args.json:
        print(json.dumps([one._asdict() for one in found], indent=2))
        return 0
    table = plain_table("user", "team", "laptop", "since", "runs")
    for one in found:
        if one.laptop:
            user, runs = one.user or "(router)", _runs(one)
            table.add_row(user, one.team or "-", one.laptop, one.since, runs)
    console(args).print(table)
    if missing := [one.user for one in found if not one.laptop]:
        print(f"Not here yet: {some(missing, 40)}.")
    if known is not None and known.team:
        print(f"You see your own team, {known.team!r}.")
    return 0


def _runs(one: Person) -> str:
    return some(one.runs, MOST) if one.runs else "nothing" if one.here else "away"


def _of_all(fabric: Fabric) -> list[dict[str, Any]]:
    """Return the agents of every fabric at this router, with the fabrics' names."""
    session = fabric.session
    told = on_each(session, fabrics(session), lambda s: Fabric(s).agents())
    return [
        {"fabric": name, **row}
        for name, rows in told.items()
        if not isinstance(rows, FabricError)  # its run has just ended
        for row in sorted(rows, key=_order)
    ]


def _order(agent: Mapping[str, Any]) -> tuple[int, str]:
    return PHASES.index(agent["kind"]), agent["agent"]
