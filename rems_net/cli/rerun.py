"""`rems rerun [DIR]`: a recorded run is done again and compared, to the bit."""

import argparse
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

from rems_net.agents.experiment.again.compared import Compared, Difference, compare
from rems_net.agents.experiment.again.rebuilt import rebuild
from rems_net.agents.experiment.checking.settings import check_seed
from rems_net.cli.info import recording_in
from rems_net.cli.options import add_run, pairs, run_of
from rems_net.toml import value_of

EXAMPLES = """\
examples:
  rems rerun                         the newest run: the same, to the bit?
  rems rerun runs/lab
  rems rerun runs/lab/run.mcap --seed 3
  rems rerun runs/lab --set robot/sim.track="130 mm"
  rems rerun runs/lab --replace process/pid=mine.py:Pid
  rems rerun runs/lab --only process/pid               it alone
"""
#: fields of an agent that are shown
FIELDS = 6
#: exit status of a rerun that differs
DIFFERS = 1


def add(parser: argparse.ArgumentParser) -> None:
    add_run(parser)
    parser.add_argument(
        "--set",
        metavar="AGENT.SETTING=VALUE",
        action="append",
        default=[],
        help="change a parameter, an option or an initial value",
    )
    parser.add_argument(
        "--replace",
        metavar="AGENT=CLASS",
        action="append",
        default=[],
        help="another class of the same kind: mine.py:Better, or a name",
    )
    parser.add_argument(
        "--only",
        metavar="AGENT",
        default="",
        help="compute this agent; all others play their recording",
    )
    parser.add_argument(
        "--fabric",
        action="store_true",
        help="each agent in a process of its own, as `rems run`",
    )
    parser.add_argument(
        "--seed", metavar="N", type=int, help="seed of the random numbers"
    )


def run(args: argparse.Namespace) -> int:
    """Do it again, and print what differs."""
    here = str(Path.cwd())
    if here not in sys.path:  # as for `python lab.py`
        sys.path.insert(0, here)
    rebuilt = rebuild(recording_in(run_of(args)), Path())
    for key, cls in pairs(args.replace, "--replace process/pid=mine.py:Better"):
        rebuilt.replace(key, cls)
    for where, text in pairs(args.set, '--set robot/sim.track="130 mm"'):
        rebuilt.set(where, value_of(text))
    if args.only:
        rebuilt.only(args.only)
    if args.seed is not None:
        rebuilt.lab.seed = check_seed(args.seed)
    for sentence in rebuilt.differing(rebuilt.check()):
        print(sentence)
    result = compare(rebuilt, fabric=args.fabric)
    show(result, rebuilt.lab.dt, rebuilt.told.ticks, print)
    return DIFFERS if result.differ else 0


def show(result: Compared, dt: float, ticks: int, put: Callable[[str], object]) -> None:
    """Print the result, agent by agent, in the order of the first differences."""
    if result.last < ticks:
        put(f"The recording ends at tick {result.last}; the experiment has {ticks}.")
    differing = dict(result.by_agent())
    width = max(map(len, result.agents), default=0)
    for key in [*differing, *(k for k in result.agents if k not in differing)]:
        verdict = result.agents.get(key, "missing")
        some = differing.get(key)
        if some:
            t = f"tick {some[0].tick} ({some[0].tick * dt:g} s)"
            found = f"differs from {t} on"
        else:
            found = "no difference" if verdict != "not recorded" else ""
        put(f"{key:{width}}  {verdict}  {found}".rstrip())
        for one in (some or [])[:FIELDS]:
            for line in described(one):
                put(f"    {line}")
        if len(some or []) > FIELDS:
            put(f"    and {len(some or []) - FIELDS} more fields")
    for robot, pair in result.pairs.items():
        put(f"{robot}, {pair}")
    if result.differ:
        put(f"{result.differ} of {result.messages} messages differ.")
    else:
        put(f"Zero difference: {result.messages} messages are the same, to the bit.")


def described(one: Difference) -> Iterator[str]:
    """Yield two lines on a field that differs: its first values, and how much."""
    unit = f" {one.unit}" if one.unit else ""
    port = one.key.rpartition("/")[2]
    name = f"{port}/{one.path}" if one.path else port
    yield f"{name}  {one.was!s:.24}, now {one.now!s:.24}{unit}"
    apart = "" if one.most is None else f"; at most {one.most:.3g}{unit} apart"
    yield f"    from tick {one.tick} on, in {one.ticks} messages{apart}"
