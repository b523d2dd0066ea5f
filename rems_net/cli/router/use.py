"""`rems router use ADDRESS`: use the router of a class from now on."""

import argparse
import getpass
import os
import sys

from rems_net.cli.options import add_fabric
from rems_net.client import Fabric
from rems_net.errors import ExperimentError, FabricError, some
from rems_net.router.find import PASSWORD, VARIABLE, credentials
from rems_net.router.finding import address, remembered
from rems_net.router.finding.scouting import scout
from rems_net.router.gate.identity import check_member, identity
from rems_net.router.gate.users import OWNER
from rems_net.router.keys import check_name
from rems_net.router.session import Session
from rems_net.router.settings import Link

EXAMPLES = f"""\
examples:
  rems router use tcp/192.168.1.20      as `rems router serve` prints it
  rems router use 30AG-08M6             its code
  rems router use lab-pc                a name
  rems router use lab-pc --fabric team3     runs of a team, on several laptops
  rems router use lab-pc --user anna    as on your slip; asks for the password
  rems router use                       which routers can be found here?
  rems router forget                      as before
{VARIABLE} wins over what was joined.
"""


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("address", metavar="ADDRESS", nargs="?", help="of the router")
    parser.add_argument("--user", metavar="NAME", help="who you are, as on your slip")
    add_fabric(parser)


def run(args: argparse.Namespace) -> int:
    """Join, store it, and print the agents there; or look for routers."""
    if args.address is None:
        return _look()
    if args.address.endswith((".toml", ".py")):
        raise ExperimentError(
            f"{args.address} is an experiment; to bring its agents to an open fabric, "
            f"type: rems agent start {args.address} (R0604)"
        )
    endpoint = address.to_endpoint(args.address)
    name = args.fabric and check_name(args.fabric, "--fabric")
    user, password = _known(args.user, endpoint)
    with Session(Link(endpoint, user=user, password=password)) as session:
        known = identity(session)
        if team := known.team if known else "":
            check_member(session.on(name or team))
        if user == OWNER:  # the running router's note contains the password
            user = password = ""
            print("This machine runs the router, and needs no password.")
        elif user:
            print(f"You are {user!r}{f', of the team {team!r}' if team else ''}.")
        remembered.remember(endpoint, name or team, user, password)
        own = remembered.fabric()
        whose = "of your team" if team else "of your own"
        print(f"Joined {endpoint}. From now on every rems command goes there;")
        print(f"`rems run` is on a fabric {whose}, {own!r}.")
        print(f"{_who(Fabric(session))} `rems router forget` forgets it.")
    return 0


def _known(user: str | None, endpoint: str) -> tuple[str, str]:
    """Return user and password: from the environment, or typed."""
    if user is None:
        return credentials(endpoint)
    check_name(user, "--user")
    password = os.environ.get(PASSWORD, "")
    if not password and sys.stdin.isatty():
        password = getpass.getpass(f"Password of {user}: ").strip()
    if not password:
        raise FabricError(
            f"the password of {user!r} is asked in a terminal, and this is none; set "
            f"{PASSWORD}. (R0909)"
        )
    return user, password


def _who(fabric: Fabric) -> str:
    try:
        agents = sorted(row["agent"] for row in fabric.agents())
    except FabricError:
        return "No fabric is open there yet."
    return f"There: {some(agents, 6) if agents else 'nobody yet'}."


def _look() -> int:
    now = remembered.router()
    if now:
        print(f"You have joined {now}.")
    found = scout()
    for endpoint in found:
        print(f"rems router use {endpoint}")
    if not found:
        print(
            "No router was found. Many networks hide them; ask for the address that "
            "`rems router serve` prints."
        )
    return 0 if found or now else 1
