"""`rems board bridge PORT`: connect a robot without Wi-Fi, over its USB cable."""

import argparse
import time

from rems_net.cable.bridge import Bridge
from rems_net.cable.console import Console
from rems_net.cable.port import Line, open_port
from rems_net.cable.provision import CABLE
from rems_net.cli.options import warn
from rems_net.errors import FabricError, uncoded
from rems_net.router.find import chosen
from rems_net.router.finding.address import host_and_port, to_endpoint

#: endpoint of `rems router serve` on this laptop
HERE = "tcp/127.0.0.1:7447"
#: s. Interval of attempts to reopen a cable that was pulled out.
PAUSE = 1.0
EXAMPLES = """\
examples:
  rems board provision --port COM3 --router cable   once, to begin with
  rems board bridge COM3           to the router that is used, or this laptop's
  rems board bridge /dev/ttyUSB0 lab-pc           to another one
It goes on until Ctrl+C; the cable may be pulled out, and plugged in again.
"""


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("port", metavar="PORT", help="the robot's serial port")
    parser.add_argument(
        "address",
        metavar="ADDRESS",
        nargs="?",
        help="of a router; see `rems router use`",
    )


def run(args: argparse.Namespace) -> int:
    """Relay the robot's session to the router, until Ctrl+C."""
    endpoint = to_endpoint(args.address) if args.address else chosen() or HERE
    router = host_and_port(endpoint)
    if not endpoint.startswith("tcp/") or not router[1]:
        raise FabricError(
            f"a bridge goes to a plain tcp address; got {endpoint}. (R0706)"
        )
    line = open_port(args.port)
    _check(Console(line), args.port)
    print(f"{args.port} <-> {endpoint}; Ctrl+C ends it", flush=True)
    while True:
        try:
            Bridge(line, router, lambda text: print(text, flush=True)).run()
        except OSError as error:
            warn(f"the cable was pulled out: {uncoded(error)}. Waiting for it.")
        finally:
            line.close()
        line = _again(args.port, line.baudrate)


def _check(robot: Console, port: str) -> None:
    """Raise FabricError if the robot does not use the cable for its router."""
    robot.find(port)
    if robot.ask("get router") != [f"router {CABLE}"]:
        raise FabricError(
            f"the robot at {port} goes by Wi-Fi. For the cable, type: "
            f"rems board provision --port {port} --router {CABLE} (R0706)"
        )


def _again(port: str, baud: int) -> Line:
    while True:
        try:
            return open_port(port, baud)
        except FabricError:
            time.sleep(PAUSE)
