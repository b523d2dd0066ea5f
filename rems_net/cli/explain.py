"""`rems explain R0104`: the meaning of the code at the end of a message."""

import argparse
import textwrap
from itertools import groupby

from rems_net.explain import Entry, entries, find

EXAMPLES = """\
examples:
  rems explain R0104               what this error means, and how to mend it
  rems explain                     all codes
"""


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "code", metavar="CODE", nargs="*", help="a code, or a message that ends in one"
    )


def run(args: argparse.Namespace) -> int:
    """Print the entry of a code, or the list of all."""
    if args.code:
        print("\n".join(shown(find(" ".join(args.code)))))
        return 0
    for group, listed in groupby(entries().values(), lambda entry: entry.group):
        print(group)
        for entry in listed:
            print(f"  {entry.code}  {entry.title}")
    print("For one of them, type: rems explain CODE")
    return 0


def shown(entry: Entry) -> list[str]:
    """Return an entry as lines of at most 80 columns."""
    lines = [f"{entry.code}: {entry.title}", "", *textwrap.wrap(entry.text, 79)]
    for block in entry.blocks:
        lines += ["", "Right:" if block.right else "Wrong:"]
        lines += [f"  {line}".rstrip() for line in block.text.splitlines()]
    return lines
