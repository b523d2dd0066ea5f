"""`rems stop`: every robot stops, now, and stays so until released."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import NamedTuple

from rems_net.cli.words import add_at, warn
from rems_net.errors import FabricError
from rems_net.fabric import Fabric, join
from rems_net.router.find import chosen, everywhere, fabrics
from rems_net.router.keys import FABRIC

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


Tell = Callable[[Fabric], Told]


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
    tell = _release if args.release else _stop
    if args.at or chosen():
        with join(tell=warn, fabric=args.fabric, at=args.at) as fabric:
            told = _on(fabric, args.all, tell)
    else:  # whoever says stop, and does not say to whom, means all
        told = everywhere(lambda session: tell(Fabric(session, warn)), FABRIC)
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


def _on(fabric: Fabric, all_: bool, tell: Tell) -> dict[str, Told | FabricError]:
    """What is told of this fabric, or of all at its router, by name."""
    session = fabric.session
    told: dict[str, Told | FabricError] = {}
    for name in fabrics(session) if all_ else [session.fabric]:
        try:
            told[name] = tell(Fabric(session.on(name), warn))
        except FabricError as error:
            told[name] = error
    return told


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
