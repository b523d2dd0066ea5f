"""`rems check`: an experiment, a robot, or all robots.

`rems check lab.toml` checks an experiment, `rems check woodbot mujoco` a robot, and
`rems check robots` measures every robot with every driver.
"""

import argparse
from importlib import import_module
from types import ModuleType
from typing import Any

from rems_net.errors import ExperimentError

EXAMPLES = """\
examples:
  rems check lab.toml                    an experiment, and its first ticks
  rems check weave.py                    a script, up to its first run()
  rems check my_file.py:MyRobot          a robot, by its own mathematics
  rems check woodbot mujoco              a robot and its driver
  rems check woodbot my_file.py:MyDriver
  rems check my_file.py:MyRobot mujoco --set options.physics_step=2ms
  rems check create2 create2 --set options.port=/dev/ttyUSB0 --moves
  rems check woodbot kinematic --alone   without processes: faster
  rems check robots                      every robot with every driver
  rems check robots woodbot mujoco       one robot, or one driver

Of an experiment every agent steps twice, without a network; nothing is written
and no device is opened. A robot is tried against what every robot must do
(docs/robots.md). `robots` prints a table: how far each robot goes from
its own mathematics in slow motion, as a share of the way, and how many steps of
0.1 s it makes in a second. Hardware is emulated: exchanges per second, and ~
before a share that differs from run to run. An ! is more than the definition
allows.

The exit status is 0 if all is well, else 1, or 2 for an experiment that cannot
be started.
"""
#: option -> its arguments for argparse; all are for robots
_OPTIONS: dict[str, dict[str, Any]] = {
    "--set": {
        "metavar": "NAME=VALUE",
        "action": "append",
        "default": [],
        "help": "of a robot: parameters.NAME, options.NAME or initial.NAME",
    },
    "--moves": {"action": "store_true", "help": "a robot of hardware may move"},
    "--alone": {"action": "store_true", "help": "of a robot: start no processes"},
    "--only": {
        "metavar": "CHECK",
        "action": "append",
        "default": [],
        "help": "of a robot: this check, such as stops; may be given again",
    },
    "--json": {"action": "store_true", "help": "of robots: for programs"},
}
#: word that asks for the table of all robots
ROBOTS = "robots"


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "what", metavar="WHAT", help=f"a file, a robot's definition, or `{ROBOTS}`"
    )
    parser.add_argument(
        "more", metavar="PART", nargs="*", help="a driver (kinematic); of robots, any"
    )
    for option, words in _OPTIONS.items():
        parser.add_argument(option, **words)


def run(args: argparse.Namespace) -> int:
    """Check the named file, robot or robots, and print the results."""
    name, allowed = _meant(args)
    for option in _OPTIONS:
        if getattr(args, option.strip("-")) and option not in allowed:
            raise ExperimentError(
                f"{option} is for `rems check ROBOT DRIVER`; got it with {args.what}."
                " (R0904)"
            )
    module: ModuleType = import_module(f"rems_net.cli.check.{name}")
    status: int = module.run(args)
    return status


def _meant(args: argparse.Namespace) -> tuple[str, tuple[str, ...]]:
    """Return the module for the named subject, and the options that it takes."""
    if args.what.endswith((".toml", ".py")):
        if args.more:
            raise ExperimentError(
                f"{args.what} is an experiment and is checked alone; leave out "
                f"{' '.join(args.more)}. For a class in a file: {args.what}:MyRobot"
                " (R0904)"
            )
        return "experiment", ()
    if args.what == ROBOTS:
        return "robots", ("--json",)
    if len(args.more) > 1:
        raise ExperimentError(
            f"expected a definition and a driver, such as `rems check woodbot mujoco`; "
            f"got {args.what} {' '.join(args.more)}. (R0904)"
        )
    return "robot", tuple(_OPTIONS)
