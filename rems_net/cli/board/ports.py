"""`rems board ports`: the serial ports of this machine, and what answers there."""

import argparse
import json

from rems_net.cable.device import who
from rems_net.cli.options import console, plain_table
from rems_net.drivers.hardware.ports import Port, ports, there_are
from rems_net.errors import FabricError

EXAMPLES = """\
examples:
  rems board ports                  what answers at the ports of USB?
  rems board ports /dev/ttyS0 COM3  what answers at these?
  rems board ports --quiet          only which are there: nothing is asked
  rems board ports --json

Asking moves nothing. A robot that another program drives is left alone.
"""


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("port", metavar="PORT", nargs="*", help="only these")
    parser.add_argument("--quiet", action="store_true", help="ask nobody")
    parser.add_argument("--json", action="store_true", help="for programs")


def run(args: argparse.Namespace) -> int:
    """List the ports, and ask at USB ports, or at the named ones."""
    named = [Port(device, "", True) for device in args.port]
    found = named or ports()
    if not found:
        raise FabricError(f"{there_are()} (R0701)")
    rows = [(port, "" if args.quiet else _answer(port)) for port in found]
    if args.json:
        keys = ("port", "text", "answer")
        each = [dict(zip(keys, (p.device, p.text, a), strict=True)) for p, a in rows]
        print(json.dumps(each, indent=2))
        return 0
    table = plain_table("port", "the system's name", "" if args.quiet else "answers")
    for port, answer in rows:
        table.add_row(port.device, port.text, answer)
    console(args).print(table)
    if not any(port.usb for port in found):
        print("\nNone of them is of USB: is the robot's cable plugged in?")
    return 0


def _answer(port: Port) -> str:
    """Return what answers there, or why it is unknown."""
    if not port.usb:
        return f"not asked: rems board ports {port.device}"
    try:
        return who(port.device) or "nothing that rems knows"
    except FabricError as error:
        return str(error)
    except OSError as error:
        return f"gone while it was asked: {error}"
