"""`rems demo`: one Woodbot, three implementations, one fabric."""

import argparse
from pathlib import Path

import rems_net
from rems_net.agents.experiment.file import load
from rems_net.cli.options import console
from rems_net.cli.run import Runner, add_common
from rems_net.errors import MissingPartError, uncoded

EXAMPLES = """\
examples:
  rems demo
  rems demo --pace 1          in real time
  rems demo --out /tmp/demo
"""
#: The demo is an experiment file like any other.
FILE = Path(rems_net.__file__).parent / "demo" / "demo.toml"


def add(parser: argparse.ArgumentParser) -> None:
    add_common(parser)


def run(args: argparse.Namespace) -> int:
    """Run the demo with the robots whose libraries are installed; name the others."""
    experiment, without = load(FILE), []
    for key, plan in list(experiment.plans.items()):
        try:
            plan.build().prepare()
        except MissingPartError as error:
            without.append(f"without {key.removeprefix('robot/')}: {uncoded(error)}")
            del experiment.plans[key]
    Runner(args)(experiment)
    for line in without:
        console(args).print(line, style="dim")
    return 0
