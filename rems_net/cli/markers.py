"""`rems markers 0-9 --size 40mm`: markers to print, for robots and things."""

import argparse
import re
from pathlib import Path

from rems_net.bodies.marker import FAMILIES, Marker
from rems_net.cli.options import writing
from rems_net.errors import ExperimentError
from rems_net.eyes.page import pages
from rems_net.scenes.marking import MARKER

EXAMPLES = """\
examples:
  rems markers 0-9 --size 40mm           markers.svg: an A4 page to print
  rems markers 3,7 --size 60mm --out big.svg
  rems markers 0-5 --family tag25h9

A browser prints the page: choose "actual size", and measure the ruler on it.
"""


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("ids", metavar="IDS", help="such as 0-9 or 3,7")
    parser.add_argument(
        "--size", metavar="SIZE", default="40mm", help="of the black square (40mm)"
    )
    parser.add_argument(
        "--family", choices=[*FAMILIES], default=next(iter(FAMILIES)), help="of markers"
    )
    parser.add_argument(
        "--out", metavar="FILE", type=Path, default=Path("markers.svg"), help="the page"
    )


def run(args: argparse.Namespace) -> int:
    """Write the pages, and list them."""
    # "40mm", as people type it here, is "40 mm" everywhere else.
    size = re.sub(r"(?<=\d)(?=[a-zA-Z])", " ", args.size)
    ids = [*_ids(args.ids)]
    if re.fullmatch(r"[\d.,\s]+", size):
        raise ExperimentError(
            f"--size {args.size!r}: expected a length with its unit, such as "
            f"{args.size.strip()}mm. (R1106)"
        )
    length = MARKER({"size": size})["size"]
    made = pages([Marker(args.family, number, length) for number in ids])
    for number, page in enumerate(made, 1):
        stem = args.out.stem if number == 1 else f"{args.out.stem}_{number}"
        path = args.out.with_stem(stem)
        with writing(path):
            path.write_text(page, encoding="utf-8", newline="\n")
        print(path)
    return 0


def _ids(text: str) -> list[int]:
    """Return the ids of a text such as "0-9,12". Raises ExperimentError."""
    found: list[int] = []
    for part in text.split(","):
        match = re.fullmatch(r"\s*(\d{1,4})\s*(?:-\s*(\d{1,4}))?\s*", part)
        if match is None:
            raise ExperimentError(
                f"{text!r} names no markers; write ids such as 0-9 or 3,7. (R1106)"
            )
        first, last = int(match[1]), int(match[2] or match[1])
        found += range(min(first, last), max(first, last) + 1)
    return [*dict.fromkeys(found)]
