"""`rems stop`: every robot stops, now, and stays so until released."""

from __future__ import annotations

import argparse
from typing import NamedTuple

from rems_net.cli.words import add_at, warn
from rems_net.errors import FabricError
from rems_net.fabric import Fabric, join
from rems_net.fabric.stopping import stop_each
from rems_net.router.find import chosen, everywhere, fabrics, on_each
from rems_net.router.keys import FABRIC
from rems_net.router.session import Session

EXAMPLES = """\
examples:
  rems stop
  rems stop --release
  rems stop --at 7448         of several runs, this one only
  rems stop --all             every fabric at the class's router
"""


class Told(NamedTuple):
    """What a run says, and whether all is well there."""

    lines: list[str]
    well: bool = True


def add(parser: argparse.ArgumentParser) -> None:
    """What `rems stop` can be told."""
    parser.add_argument(
        "--release", action="store_true", help="let the robots obey commands again"
    )
    parser.add_argument(
        "--all", action="store_true", help="on all fabrics at a class's router"
    )
    add_at(parser)


def run(args: argparse.Namespace) -> int:
    """Stop, and say who stands; or release. 1 where one does not stand."""

    def tell(session: Session) -> dict[str, Told | FabricError]:
        names = fabrics(session) if args.all else [session.fabric]
        if not args.release:
            stop_each(session, names)  # first of all, whoever has to be waited for
        ask = _release if args.release else _stop
        return on_each(session, names, lambda one: ask(Fabric(one, warn)))

    told: dict[str, Told | FabricError] = {}
    if args.at or chosen():
        with join(tell=warn, fabric=args.fabric, at=args.at) as fabric:
            told = tell(fabric.session)
    else:  # whoever says stop, and does not say to whom, means all
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
    for where, said in runs.items():
        print("\n".join([f"At {where}:"] * (len(told) > 1) + said.lines))
    for error in errors:
        warn(error)
    if not args.release:
        print("Let them go on with: rems stop --release")
    return 0 if not errors and all(said.well for said in runs.values()) else 1


def _stop(fabric: Fabric) -> Told:
    receipts = fabric.stop()
    return Told([str(one) for one in receipts], all(one.stands for one in receipts))


def _release(fabric: Fabric) -> Told:
    return Told([_released(fabric.release())])


def _released(who: list[str] | bool) -> str:
    if isinstance(who, list):
        return f"released: {', '.join(who) or 'no robot is there'}"
    if who:
        return "released: the router kept a STOP; the next run may drive"
    return "there was nothing to release: no experiment runs, and no STOP is kept"
