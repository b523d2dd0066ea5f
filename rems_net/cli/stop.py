"""`rems stop`: every robot stops, now, and stays so until released.

With a robot's key: it is taken back from the run elsewhere that drives it.
"""

import argparse
import math
import time
from contextlib import suppress
from threading import Event
from typing import NamedTuple

from rems_net.cli.options import add_at, warn
from rems_net.client import Fabric, join
from rems_net.client.stopping import fabrics_to_stop, stop_each
from rems_net.errors import ExperimentError, FabricError, NoRouterError
from rems_net.router import notes
from rems_net.router.find import chosen, everywhere, on_each, over_loopback
from rems_net.router.finding import remembered
from rems_net.router.keys import FABRIC, is_name
from rems_net.router.session import Session

#: s. Pause before STOP is repeated to a router that is down.
AGAIN = 0.25
#: s. Robots have this long to reconnect to a restarted router: twice the 5 s within
#: which a robot is to return.
BACK = 10.0
EXAMPLES = """\
examples:
  rems stop
  rems stop --release
  rems stop --at 7448         of several runs, this one only
  rems stop --all             every fabric at the class's router
  rems stop robot/wood        take one back from the run that drives it
"""


class Told(NamedTuple):
    """Printed lines of one run; whether all is well there; its number of robots."""

    lines: list[str]
    well: bool = True
    robots: int = 1


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "robot",
        nargs="?",
        default="",
        metavar="KEY",
        help='end the lease of this robot, which a run drives by driver = "remote"',
    )
    parser.add_argument(
        "--release", action="store_true", help="let the robots obey commands again"
    )
    parser.add_argument(
        "--all", action="store_true", help="on all fabrics at a class's router"
    )
    add_at(parser)


def run(args: argparse.Namespace) -> int:
    """Stop, and print which robots stand; or release. Return 1 if one does not stand.

    While a known router is down, STOP is repeated.
    """
    if args.robot:
        return _take(args)
    away = "" if args.release else _known(args)
    down, give_up = False, math.inf
    while True:
        try:
            waits = down and time.monotonic() < give_up
            code = _run_once(args, waits=waits)
            if code is not None:
                if down:
                    print("A robot that comes back later stands still, too.")
                return code
            give_up = min(give_up, time.monotonic() + BACK)
        except NoRouterError:
            if not away:
                raise
            if not down:
                warn(
                    f"The router at {away} does not answer; STOP is repeated until "
                    "it does. Ctrl+C gives up."
                )
            down, give_up = True, math.inf
        Event().wait(AGAIN)


def _take(args: argparse.Namespace) -> int:
    """Take one robot back. Return 1 if no run had it."""
    if args.release or args.all:
        raise ExperimentError(
            f"{args.robot} alone is taken back from a run; --release and --all are for "
            "every robot. Type one or the other. (R0904)"
        )
    there, _, name = f"/{args.robot}".rpartition("/robot/")
    there = there.removeprefix("/")
    if not is_name(name) or not (is_name(there) or there == ""):
        raise ExperimentError(
            f"{args.robot!r} is no robot; expected one, such as robot/wood. (R0904)"
        )
    robot = f"robot/{name}"
    with join(fabric=args.fabric or there, at=args.at) as fabric:
        holder = fabric.take(robot)
    if holder:
        print(f"{robot} stands: it was taken back from {holder}.")
        print("Another run may drive it now.")
        return 0
    warn(f"no run elsewhere drives {robot}. To stop every robot, type: rems stop")
    return 1


def say(
    session: Session, *, everywhere_there: bool, release: bool
) -> dict[str, Told | FabricError]:
    """Stop or release, on the session's fabric or on all of its router; by fabric."""
    names = [session.fabric]
    if everywhere_there:
        names = fabrics_to_stop(session, release=release)
    if release:
        return on_each(session, names, lambda one: _release(Fabric(one)))
    stop_each(session, names)  # STOP to all, before waiting for any robot
    told = on_each(session, names, lambda one: _stop(Fabric(one)))
    if not everywhere_there:
        return told
    # That nobody is on the other fabrics is no news.
    news = {n: t for n, t in told.items() if not isinstance(t, Told) or t.robots}
    return news or told


def _known(args: argparse.Namespace) -> str:
    """Return the router that surely existed: a joined one, or one served here.

    Return "" for an address that was only typed: there may never have been one.
    """
    if there := chosen(args.at):
        return there if there == remembered.router() else ""
    for note in notes.find(args.fabric or FABRIC):
        with suppress(FabricError):
            told = notes.read(note)
            if told is not None and told.served:
                return told.endpoint
    return ""


def _run_once(args: argparse.Namespace, *, waits: bool = False) -> int | None:
    """Return the exit status; None if it waits for robots and there is none yet."""

    def tell(session: Session) -> dict[str, Told | FabricError]:
        return say(session, everywhere_there=args.all, release=args.release)

    told: dict[str, Told | FabricError] = {}
    if there := chosen(args.at):
        session = over_loopback(there, args.fabric, args.at)
        with (
            Fabric(session)
            if session is not None
            else join(fabric=args.fabric, at=args.at)
        ) as fabric:
            told = tell(fabric.session)
    else:  # without an address, STOP goes to all runs of this user
        for where, here in everywhere(tell, args.fabric or FABRIC).items():
            if isinstance(here, FabricError):
                told[where] = here
                continue
            for name, each in here.items():
                told[f"{name}, {where}" if args.all else where] = each
    errors = [each for each in told.values() if isinstance(each, FabricError)]
    runs = {where: each for where, each in told.items() if isinstance(each, Told)}
    if not runs:
        raise errors[0]
    if waits and not any(said.robots for said in runs.values()):
        return None
    for where, said in runs.items():
        print("\n".join([f"At {where}:"] * (len(told) > 1) + said.lines))
    for error in errors:
        warn(error)
    if not args.release:
        print(f"Let them go on with: rems stop --release{' --all' * args.all}")
    return 0 if not errors and all(said.well for said in runs.values()) else 1


def _stop(fabric: Fabric) -> Told:
    receipts = fabric.stop()
    if not receipts:
        text = "no robot is there; one that comes will stand"
        return Told([text], well=False, robots=0)
    stand = all(receipt.stands for receipt in receipts)
    return Told([*map(str, receipts)], stand, len(receipts))


def _release(fabric: Fabric) -> Told:
    who = fabric.release()
    line = "there was nothing to release: no experiment runs, and no STOP is kept"
    if isinstance(who, list):
        line = f"released: {', '.join(who) or 'no robot is there'}"
    elif who:
        line = "released: the router kept a STOP; the next run may drive"
    return Told([line])
