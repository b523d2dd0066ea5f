"""`rems call AGENT VERB [ARGUMENT ...]`: call a method of an agent."""

import argparse
import json

from rems_net.cli.options import add_at, json_or_text
from rems_net.client import join

EXAMPLES = """\
examples:
  rems call robot/sim reset
  rems call robot/arm grip 0.02 firmly=true
"""


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("agent", metavar="AGENT", help="such as robot/sim")
    parser.add_argument("method", metavar="VERB", help="such as reset")
    parser.add_argument("arguments", nargs="*", default=(), metavar="ARGUMENT")
    add_at(parser)


def run(args: argparse.Namespace) -> int:
    """Call the method, and print what it returns."""
    given = [json_or_text(a) for a in args.arguments if not _named(a)]
    named = {
        name: json_or_text(text)
        for name, _, text in (a.partition("=") for a in args.arguments if _named(a))
    }
    with join(fabric=args.fabric, at=args.at) as fabric:
        returned = fabric.call(args.agent, args.method, tuple(given), named)
    if returned is not None:
        print(json.dumps(returned))
    return 0


def _named(argument: str) -> bool:
    name, equals, _ = argument.partition("=")
    return bool(equals) and name.isidentifier()
