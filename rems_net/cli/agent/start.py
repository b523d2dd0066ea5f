"""`rems agent start KIND TYPE`, or EXPERIMENT: agents on an open fabric."""

import argparse
import sys
from functools import partial
from pathlib import Path
from typing import Any

from rems_net.agents.experiment.experiment import Experiment
from rems_net.agents.experiment.serving import attend
from rems_net.agents.experiment.show import Show
from rems_net.agents.protocol.plan import slots_of
from rems_net.cli.options import add_fabric, fabric_of, pairs, settings_of, warn
from rems_net.cli.script import run_experiment
from rems_net.errors import ExperimentError, nearest, some
from rems_net.events import Event

EXAMPLES = """\
examples:
  rems agent start robot woodbot mujoco --name alice
  rems agent start robot woodbot kinematic --name bob --to command=input/keys
  rems agent start input keys.csv --name keys
  rems agent start process my_file.py:Follow --to target=robot/alice/state
  rems agent start robot my_file.py:Cart kinematic \\
      --set parameters.track="120 mm"
  rems agent start output csv --to robots='robot/*'
  rems agent start robot woodbot mujoco --restart 3   again after a crash
  rems agent start lab.toml                     all agents of an experiment
  rems agent start weave.py -- fast 3           or of a script, up to its run()

It needs an open fabric: `rems router serve`, here or on the teacher's laptop.
Agents go to the fabric of your team, if `rems router use` has joined one, or
else to the class's.
"""
KINDS = ("input", "robot", "process", "output")


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("kind", metavar="KIND", help=f"{', '.join(KINDS)}, or a file")
    parser.add_argument(
        "type", metavar="TYPE", nargs="?", help="as in `rems show`, or a file"
    )
    parser.add_argument("driver", metavar="DRIVER", nargs="?", help="of a robot")
    parser.add_argument("--name", help="on the fabric (that of its type)")
    parser.add_argument(
        "--to", metavar="PORT=KEY", action="append", default=[], help="connect an In"
    )
    parser.add_argument(
        "--set",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="a setting: options.NAME; of a robot parameters.NAME or initial.NAME, too",
    )
    parser.add_argument("--every", type=int, default=1, help="step at every k-th tick")
    parser.add_argument(
        "--restart",
        metavar="N",
        type=int,
        default=0,
        help="start it again after a crash, up to N times",
    )
    add_fabric(parser)
    parser.add_argument("--out", type=Path, help="folder for what it makes")


class Saying(Show):
    """Display of the agent's events on stderr, without their source."""

    def say(self, source: str, event: Event) -> None:
        print(event, file=sys.stderr, flush=True)


def run(args: argparse.Namespace) -> int:
    """Start one agent, or all of an experiment, and stay until Ctrl+C."""
    path = Path(args.kind)
    if path.suffix in (".toml", ".py"):
        if args.type or args.name or args.to or args.set:
            raise ExperimentError(
                f"{path} names its agents, and how they are connected; "
                "leave out TYPE, --name, --to and --set, or name one KIND and TYPE."
                " (R0904)"
            )
        run_experiment(path, args.words, partial(_attend, args, Show()))
        return 0
    if args.kind not in KINDS or not args.type:
        raise ExperimentError(
            f"expected a kind ({', '.join(KINDS)}) and a type, such as `rems agent "
            f"start robot woodbot kinematic`, or a file; got {args.kind!r}."
            f"{nearest(args.kind, KINDS)} (R0906)"
        )
    _attend(args, Saying(), _alone(args))
    return 0


def _attend(
    args: argparse.Namespace,
    show: Show,
    experiment: Experiment,
    /,
    out: Path | str | None = None,
    **_: object,
) -> None:
    """Start an experiment's agents, and stay; a script's `run` calls this instead."""
    experiment.fabric = fabric_of(args) or experiment.fabric
    warn(f"{some(experiment.plans)}: Ctrl+C ends it")
    attend(experiment, args.out or out, show)


def _alone(args: argparse.Namespace) -> Experiment:
    """Return an experiment of one agent."""
    kind, types = args.kind, [args.type]
    name = args.name or Path(args.type.rpartition(":")[2]).stem.lower()
    settings = settings_of(args.set, "options.file=keys.csv")
    sources = dict(pairs(args.to, "--to command=input/keys"))
    if kind == "robot":
        if not args.driver:
            raise ExperimentError(
                "a robot needs a driver, too: `rems agent start robot "
                f"{args.type} kinematic`; `rems show` lists them. (R0904)"
            )
        if wrong := sources.keys() - {"command"}:
            raise ExperimentError(
                f"--to {min(wrong)}: a robot has one In, `command`. (R0904)"
            )
        types.append(args.driver)
    elif args.driver:
        raise ExperimentError(
            f"only a robot has a driver; {kind} has a TYPE alone. (R0904)"
        )
    elif args.type.endswith(".csv"):
        types, settings = ["csv"], {"options.file": args.type, **settings}
    lab = Experiment(name)
    common = {"every": args.every, "restart": args.restart}
    getattr(lab, kind)(name, *types, **common, **slots(settings, kind), **sources)
    return lab


def slots(settings: dict[str, Any], kind: str = "robot") -> dict[str, Any]:
    """Group the settings of an agent: `options.port` is an option.

    Raises ExperimentError for a setting of no group.
    """
    groups: dict[str, dict[str, Any]] = {slot: {} for slot in slots_of(kind)}
    for path, value in settings.items():
        group, _, field = path.partition(".")
        if group not in groups or not field:
            expected = " or ".join(f"{slot}.NAME" for slot in groups)
            raise ExperimentError(
                f"--set {path}={value}: expected {expected} for this {kind}, such as "
                f"--set {next(iter(groups))}.{path.rpartition('.')[2]}={value} (R0910)"
            )
        groups[group][field] = value
    return groups
