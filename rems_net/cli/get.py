"""`rems get KEY`: values by their key, with units."""

import argparse
import json
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from rems_net.cli.options import add_at, console, short_key, show_value, writing
from rems_net.client import join
from rems_net.errors import ExperimentError, shown
from rems_net.pictures import is_picture, png
from rems_net.router.keys import full_key

EXAMPLES = """\
examples:
  rems get robot/kinematic/state
  rems get robot/kinematic/state/x
  rems get 'robot/*/sensors/**'
  rems get 'robot/*/state' --json
  rems get robot/kinematic/sensors/camera --save seen.png
"""


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("key", metavar="KEY", help="a key or a glob (quote it)")
    parser.add_argument("--json", action="store_true", help="for programs")
    parser.add_argument(
        "--save", metavar="FILE", type=Path, help="write the picture there, as PNG"
    )
    add_at(parser)


def run(args: argparse.Namespace) -> int:
    """Ask once, and print the current values."""
    full_key(args.key)  # Report a typo before looking for a fabric.
    with join(fabric=args.fabric, at=args.at) as fabric:
        fabric.agents()
        found = fabric.get(args.key)
        if not found:
            raise fabric.nothing_at(args.key)
    out = console(args)
    if args.save:
        save(args.key, found, args.save)
        out.print(shown(args.save))
        return 0
    if args.json:
        print(json.dumps(found, indent=2))
        return 0
    for where, plain in found.items():
        out.print("\n".join(_lines(short_key(where, fabric.session.fabric), plain)))
    return 0


def save(key: str, found: Mapping[str, Any], path: Path) -> None:
    """Write the one picture that was found. Raises ExperimentError for none, or two."""
    import numpy as np

    pictures = []
    for plain in found.values():
        fields = plain.get("values", {}) if isinstance(plain, Mapping) else {}
        for field in fields.values():
            value = field["value"]
            if isinstance(value, list):
                # any program's values
                with suppress(ValueError, TypeError, OverflowError):
                    pictures.append(np.asarray(value, np.uint8))
    pictures = [one for one in pictures if is_picture(one)]
    if len(pictures) != 1:
        raise ExperimentError(
            f"at {key} there are {len(pictures) or 'no'} pictures; --save takes one, "
            "such as rems get robot/bot/sensors/camera --save seen.png (R0910)"
        )
    if path.suffix.lower() != ".png":
        raise ExperimentError(
            f"--save {path}: it writes PNG; end the name with .png (R0910)"
        )
    with writing(path):
        path.write_bytes(png(pictures[0]))


def _lines(key: str, plain: Any) -> list[str]:
    """Return a port with its fields below it, or one field in one line."""
    if not isinstance(plain, Mapping) or "values" not in plain:
        return [f"{key}  {json.dumps(plain)}"]
    fields = plain["values"]
    when = f"tick {plain['tick']}, {plain['time']:g} s"
    path = next(iter(fields), "")
    if len(fields) == 1 and key.endswith(f"/{path}"):
        return [f"{key}  {show_value(fields[path])}  ({when})"]
    width = max((len(path) for path in fields), default=0)
    return [
        f"{key}  ({when})",
        *(f"  {path:{width}}  {show_value(value)}" for path, value in fields.items()),
    ]
