"""`rems board generate`: C files of a robot's firmware, from its definition."""

import argparse
from pathlib import Path

from rems_net.agents import parts
from rems_net.agents.robot import Definition
from rems_net.cli.options import console, warn
from rems_net.errors import shown
from rems_net.firmware import generate
from rems_net.firmware.build import sources

EXAMPLES = """\
examples:
  rems board generate                      the Woodbot's
  rems board generate --definition my_file.py:MyWoodbot
  rems board generate --check              changes nothing; 1 where it would

It writes core/woodbot_schemas.h and .c: fields, ranges, defaults and digests.
Then flash the robot anew.
"""


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--definition",
        metavar="PART",
        default="woodbot",
        help="what the robot is, as in `rems show`, or a file's (woodbot)",
    )
    parser.add_argument(
        "--check", action="store_true", help="change nothing; 1 where it is stale"
    )
    parser.add_argument(
        "--into", metavar="DIR", type=Path, help="folder of the firmware's core"
    )


def run(args: argparse.Namespace) -> int:
    """Write the stale files, or report them."""
    definition = parts.find("definition", args.definition, Path())
    assert issubclass(definition, Definition)  # `find` has checked it
    folder = args.into or sources() / "core"
    if args.check:
        stale = generate.stale(definition, folder)
        if stale:
            names = " and ".join(shown(path) for path in stale)
            verb = "are" if len(stale) > 1 else "is"
            warn(f"{names} {verb} stale. Type the same line without --check")
        return int(bool(stale))
    written = generate.write(definition, folder)
    out = console(args)
    for path in written:
        out.print(f"Wrote {shown(path)}", soft_wrap=True)
    if not written:
        out.print(f"{shown(folder)} is up to date.", soft_wrap=True)
    return 0
