"""`rems list`: who is on the fabric."""

import argparse
import json
from collections.abc import Mapping
from typing import Any

from rems_net.agents.agent import PHASES
from rems_net.cli.words import add_at, console, plain_table
from rems_net.client import Fabric, join
from rems_net.errors import FabricError
from rems_net.router.find import fabrics, on_each

EXAMPLES = """\
examples:
  rems list
  rems list --json
  rems list --all             every fabric at the class's router
"""


def add(parser: argparse.ArgumentParser) -> None:
    """What `rems list` can be told."""
    parser.add_argument("--json", action="store_true", help="for programs")
    parser.add_argument(
        "--all", action="store_true", help="all fabrics at a class's router"
    )
    add_at(parser)


def run(args: argparse.Namespace) -> int:
    """One line per agent: kind, host, rate, when it was last heard of."""
    with join(fabric=args.fabric, at=args.at) as fabric:
        agents = _of_all(fabric) if args.all else sorted(fabric.agents(), key=_order)
    if args.json:
        print(json.dumps(agents, indent=2))
        return 0
    first = ["fabric"] if args.all else []
    right = "rate", "last seen"
    table = plain_table(*first, "agent", "kind", "host", *right, right=right)
    for agent in agents:
        table.add_row(
            *(agent[column] for column in first),
            agent["agent"],
            agent["kind"],
            agent["host"],
            f"{agent['rate']:.1f} Hz",
            f"{agent['seen']:.1f} s ago",
        )
    console(args).print(table)
    return 0


def _of_all(fabric: Fabric) -> list[dict[str, Any]]:
    """The agents of every fabric at this router, with the names of the fabrics."""
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
