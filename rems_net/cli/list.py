"""`rems list`: who is on the fabric."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from typing import Any

from rems_net.agents.agent import PHASES
from rems_net.cli.words import add_at, console, plain_table, warn
from rems_net.fabric import join

EXAMPLES = """\
examples:
  rems list
  rems list --json
"""


def add(parser: argparse.ArgumentParser) -> None:
    """What `rems list` can be told."""
    parser.add_argument("--json", action="store_true", help="for programs")
    add_at(parser)


def run(args: argparse.Namespace) -> int:
    """One line per agent: kind, host, rate, when it was last heard of."""
    with join(tell=warn, at=args.at) as fabric:
        agents = sorted(fabric.agents(), key=_order)
    if args.json:
        print(json.dumps(agents, indent=2))
        return 0
    table = plain_table(
        "agent", "kind", "host", "rate", "last seen", right=("rate", "last seen")
    )
    for agent in agents:
        table.add_row(
            agent["agent"],
            agent["kind"],
            agent["host"],
            f"{agent['rate']:.1f} Hz",
            f"{agent['seen']:.1f} s ago",
        )
    console(args).print(table)
    return 0


def _order(agent: Mapping[str, Any]) -> tuple[int, str]:
    return PHASES.index(agent["kind"]), agent["agent"]
