"""`rems board provision`: give a robot its name, its Wi-Fi and its router, by USB."""

import argparse
import getpass
import os
import sys
from functools import partial

from rems_net.cable.console import Console
from rems_net.cable.port import Line, open_port
from rems_net.cable.provision import Wishes, check, for_a_robot, provision
from rems_net.cli.options import fabric_of
from rems_net.drivers.hardware.ports import there_are
from rems_net.errors import FabricError
from rems_net.router.find import chosen
from rems_net.router.finding.address import is_here

#: variable with the password, if there is no terminal to ask in
VARIABLE = "REMS_WIFI_PASSWORD"
#: prints one line of progress, at once
say = partial(print, flush=True)
EXAMPLES = f"""\
examples:
  rems board provision --port COM3        the robot's status; networks in sight
  rems board provision --port /dev/ttyUSB0 --name woodbot-7 --ssid lab-net
  rems board provision --port COM3 --router lab-pc    another router
  rems board provision --port COM3 --ssid eduroam --user anna@example.org
  rems board provision --port COM3 --router cable     then: board bridge
  rems board provision --port COM3 --ask "test servos"   on its console
The password is asked for, or read from {VARIABLE} or standard input.
"""


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--port", help="the robot's serial port")
    parser.add_argument("--name", help="of the robot: robot/NAME on the fabric")
    parser.add_argument("--fabric", default="", metavar="NAME", help="its fabric")
    parser.add_argument("--ssid", metavar="NETWORK", help="of the Wi-Fi")
    parser.add_argument("--user", metavar="NAME", help="of a Wi-Fi such as eduroam")
    parser.add_argument(
        "--router",
        action="append",
        metavar="ADDRESS",
        help="(default: the one you joined); again for a second; '' looks for one",
    )
    parser.add_argument(
        "--source", metavar="KEY", help="who may command it, such as input/keys"
    )
    parser.add_argument(
        "--ask", action="append", metavar="TEXT", help="a line for its console"
    )


def run(args: argparse.Namespace) -> int:
    """Open the port, apply the settings, and end with the robot's status."""
    wished = (args.name, args.fabric, args.ssid, args.user, args.router, args.source)
    asked = any(word is not None and word != "" for word in wished)
    if args.port is None:
        raise FabricError(f"the port is missing; write --port. {there_are()} (R0701)")
    routers = _routers(args) if asked else None
    wishes = Wishes(
        name=args.name,
        fabric=fabric_of(args) or None,
        source=args.source,
        routers=routers,
        ssid=args.ssid,
        user=args.user,
        password=_password(args.ssid) if args.ssid is not None else "",
    )
    check(wishes)
    line = open_port(args.port)
    try:
        _talk(args, line, wishes)
    except TimeoutError:
        raise FabricError(
            f"the robot at {args.port} has fallen silent. Press its reset button, and "
            "try again. (R0701)"
        ) from None
    finally:
        line.close()
    return 0


def _talk(args: argparse.Namespace, line: Line, wishes: Wishes) -> None:
    robot = Console(line)
    robot.find(args.port)
    firmware, version, chip, name = [*robot.info(), "", "", "", ""][:4]
    say(f"{args.port}: {name}, {firmware} {version} on {chip}")
    provision(robot, wishes, say)
    for command in args.ask or ():
        for text in robot.ask(command):
            say(text)
    if not args.ask:
        for text in robot.ask("status"):
            say(text)
    if wishes == Wishes() and not args.ask:
        for ssid, rssi, closed in robot.scan():
            say(f"sees {ssid} ({rssi} dBm{'' if closed else ', open'})")


def _routers(args: argparse.Namespace) -> tuple[str, ...] | None:
    """Return the routers of `--router`; else the joined one, if it is reachable."""
    if args.router is not None:
        return tuple(for_a_robot(address) for address in args.router if address)
    joined = chosen()
    if not joined or is_here(joined):
        return None
    return (for_a_robot(joined),)


def _password(ssid: str) -> str:
    if (password := os.environ.get(VARIABLE)) is not None:
        return password
    if sys.stdin is not None and sys.stdin.isatty():
        return getpass.getpass(f"Password of {ssid} (nothing if it is open): ")
    line = sys.stdin.readline() if sys.stdin is not None else ""
    if not line.endswith("\n"):
        raise FabricError(
            f"the password of {ssid} is asked in a terminal, and this is none; set "
            f"{VARIABLE}, or give it as one line of the standard input. (R0909)"
        )
    return line.rstrip("\r\n")
