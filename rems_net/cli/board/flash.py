"""`rems board flash`: write a ready image to a robot's board, over its USB cable."""

import argparse
from pathlib import Path

from rich.progress import Progress

from rems_net.agents import parts
from rems_net.agents.robot import Definition
from rems_net.cable.flash import BAUD, flash, look_for_esptool
from rems_net.cable.image import Image, load
from rems_net.cli.options import console, warn
from rems_net.drivers.hardware.ports import ports, there_are
from rems_net.errors import FabricError

EXAMPLES = """\
examples:
  rems board flash woodbot-0.1.0.bin                at the only board there is
  rems board flash woodbot-0.1.0.bin --port COM3
  rems board flash woodbot-0.1.0.bin --baud 115200  for a bad cable

woodbot-0.1.0.json has to be beside the image: its chip and its checksum.
The robot keeps its settings. docs/firmware.md shows how to make an image.
"""


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("image", metavar="IMAGE", type=Path, help="a file NAME.bin")
    parser.add_argument(
        "--port", help="the board's serial port, as in `rems board ports`"
    )
    parser.add_argument(
        "--baud", type=int, default=BAUD, help=f"bits per second ({BAUD})"
    )


def run(args: argparse.Namespace) -> int:
    """Check the image, write it, and print the next step."""
    image = load(args.image)
    look_for_esptool()
    port = args.port or _port()
    _compare(image)
    print(f"Writes {image.path.name} to the {image.chip} at {port}.", flush=True)
    with Progress(console=console(args)) as progress:
        task = progress.add_task("writing", total=1.0)
        flash(image, port, args.baud, lambda s: progress.update(task, completed=s))
    print("Written, and verified. The robot starts anew.")
    print(f"Next: rems board provision --port {port} --name NAME --ssid NETWORK")
    return 0


def _port() -> str:
    """Return the only port of USB. Raises FabricError if there are none, or several."""
    found = [port.device for port in ports() if port.usb]
    if len(found) != 1:
        what = "there are several ports; write --port. " if found else ""
        raise FabricError(f"{what}{there_are()} (R0701)")
    return found[0]


def _compare(image: Image) -> None:
    """Warn if the image was made for another definition of the Woodbot."""
    definition = parts.find("definition", "woodbot", Path())
    assert issubclass(definition, Definition)  # `find` has checked it
    robot = definition("woodbot")
    robot.prepare()
    if image.schemas != {port: s.digest for port, s in robot.published().items()}:
        warn(
            f"{image.path.name} was made by another version of rems-net than the one "
            "on this laptop: `rems list` may call the robot's values foreign. Ask "
            "your teacher for the version that fits."
        )
