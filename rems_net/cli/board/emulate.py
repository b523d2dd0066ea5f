"""`rems board emulate WHAT`: robots, and devices for drivers, without hardware.

Woodbots are on the fabric, by the firmware's own C code; the others at a port of this
machine, by `rems_net.emulators`.
"""

import argparse
import sys
import threading
from contextlib import suppress
from textwrap import fill
from typing import Any

from rems_net.cli.options import warn
from rems_net.emulators.commands import KNOWN as WORDS
from rems_net.emulators.emulator import Emulator
from rems_net.emulators.known import KNOWN, emulated
from rems_net.errors import ExperimentError, RemsError, nearest
from rems_net.firmware import build, port
from rems_net.firmware.fleet import TOGETHER, Fleet
from rems_net.router.find import open_session
from rems_net.router.keys import FABRIC, check_name, is_name
from rems_net.system.standard_input import lines

#: the lines that can be typed to a device at a port
TYPED = "\n".join(
    f"  {f'{word} {what}':16} {doc}" for word, (what, doc) in WORDS.items()
)
EXAMPLES = f"""\
examples:
  rems board emulate woodbot --name woodbot-7
  rems board emulate woodbot-fleet -n 30
  rems board emulate woodbot-fleet -n 30 --to input/keys     all by one
  rems board emulate create2               at a port, for the driver create2
  rems board emulate dynabot --port ./ttyServos

Woodbots need an open fabric: `rems router serve`, here or on the teacher's
laptop. Devices at a port need none. Type here what goes wrong with them:
{TYPED}
With `heard` behind it, a share is of the packets to the device. When it
starts, it lists what one kind alone can do, such as `lift` or `overload 2`.
"""
ONE, FLEET = "woodbot", "woodbot-fleet"
WHATS = (ONE, FLEET, *KNOWN)
#: robots of one command, at most; characters of a name, as in settings.h
MOST, LONGEST = 1000, 32
#: s. Interval in which the processes are checked.
LOOK = 0.2
#: s. Shortest interval of two lines about a device's state.
CHANGED = 1.0


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("what", metavar="WHAT", help=f"one of {', '.join(WHATS)}")
    parser.add_argument(
        "--port", default="", help="where a device is to be; not for Woodbots"
    )
    parser.add_argument("-n", type=int, default=None, help="how many (30 of a fleet)")
    parser.add_argument(
        "--name", default="woodbot", help="of one; of a fleet, with -1, -2, ... behind"
    )
    parser.add_argument(
        "--to", metavar="KEY", default="", help="who commands them, such as input/keys"
    )
    parser.add_argument(
        "--together",
        metavar="N",
        type=int,
        default=TOGETHER,
        help=f"robots that share a process, and its crash ({TOGETHER})",
    )
    parser.add_argument(
        "--library",
        action="store_true",
        help="the shared library, also where zenoh-pico is installed",
    )
    parser.add_argument("--fabric", default=FABRIC, help=f"which ({FABRIC})")


def run(args: argparse.Namespace) -> int:
    """Start the robots or the device, and stay until Ctrl+C."""
    if args.what in KNOWN:
        return _device(args.what, args.port)
    names = _names(args)
    with open_session(check_name(args.fabric, "--fabric")) as session:
        link = session.link
        # zenoh-pico here cannot log in at a router with users.
        program = None if args.library or link.user else port.program(warn)
        if program is None:
            build.library(warn)
        one = len(names) == 1
        warn(
            f"{len(names)} Woodbot{'' if one else 's'} at {link.endpoint}, "
            f"{'over zenoh-pico' if program else 'by the shared library'}; "
            f"Ctrl+C ends {'it' if one else 'them'}"
        )
        fleet = Fleet(
            session,
            names,
            lambda name, line: print(f"{name:12} {line}", flush=True),
            source=args.to,
            program=program,
            together=args.together,
        )
        with suppress(KeyboardInterrupt), fleet:
            while True:
                fleet.look(LOOK)
    return 1 if fleet.dead else 0


def _names(args: argparse.Namespace) -> list[str]:
    check_name(args.name, "--name")
    if args.what not in WHATS:
        raise ExperimentError(
            f"{args.what!r} cannot be emulated; expected one of {', '.join(WHATS)}."
            f"{nearest(args.what, WHATS)} (R0906)"
        )
    if args.port:
        raise ExperimentError(
            f"--port is for {', '.join(KNOWN)}: a {args.what} is on the fabric. (R0904)"
        )
    if args.to and not (
        args.to.count("/") == 1 and all(map(is_name, args.to.split("/")))
    ):
        raise ExperimentError(
            f"--to is {args.to!r}; expected KIND/NAME: input/keys. (R0910)"
        )
    if args.what != FLEET and args.n is not None:
        raise ExperimentError(
            f"-n is for a fleet: rems board emulate {FLEET} -n {args.n} (R0904)"
        )
    count = 30 if args.n is None else args.n
    if not 1 <= count <= MOST:
        raise ExperimentError(f"-n is {count}; expected 1 to {MOST} robots. (R0910)")
    if args.together < 1:
        raise ExperimentError(
            f"--together is {args.together}; expected at least 1. (R0910)"
        )
    names = [f"{args.name}-{i + 1}" for i in range(count)]
    names = names if args.what == FLEET else [args.name]
    if len(names[-1]) > LONGEST:
        raise ExperimentError(
            f"{names[-1]!r} is too long: a Woodbot keeps {LONGEST} letters of its name."
            " (R0910)"
        )
    return names


def _device(name: str, port: str) -> int:
    """Emulate a device until Ctrl+C, or until it fails. Return the exit status."""
    with suppress(KeyboardInterrupt), emulated(name, port) as device:
        print(f"{name} at {device.where}; Ctrl+C ends it", flush=True)
        can = f"rems: type what is to happen: {', '.join(device.words)}"
        print(fill(can, 79, break_on_hyphens=False), file=sys.stderr, flush=True)
        # It ends with this process.
        threading.Thread(target=_listen, args=(device,), daemon=True).start()
        _show(device)
    return 0


def _listen(device: Emulator[Any]) -> None:
    """Pass typed lines to the device."""
    for line in lines():
        try:
            if line:
                device.order(line)
        except RemsError as error:
            warn(error)


def _show(device: Emulator[Any]) -> None:
    """Print the device's status whenever it changes, until the device fails."""
    before = ""
    pause = threading.Event()
    while device.failure is None:
        now = device.status()
        if now != before:
            print(now, flush=True)
        before = now
        pause.wait(CHANGED)
