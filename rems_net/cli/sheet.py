"""Sheet: a page to print, with the link of each user of a class and its QR code."""

from collections.abc import Mapping
from html import escape
from pathlib import Path

from rems_net.cli.qr import drawing
from rems_net.errors import FabricError
from rems_net.router.notes import write_own

HEAD = """<!doctype html>
<meta charset="utf-8">
<title>Pages of the class</title>
<style>
body { font: 11pt sans-serif; columns: 2; }
section { break-inside: avoid; border: 1px dashed; padding: 1em; margin: 0 0 1em; }
section p { overflow-wrap: anywhere; font-family: monospace; }
</style>
"""


def sheet_of(users: Path) -> Path:
    """Return the path of the sheet, beside the list of users."""
    return users.with_suffix(".pages.html")


def write_sheet(path: Path, links: Mapping[str, tuple[str, str]]) -> None:
    """Write the sheet; only its owner can read it. Raises FabricError.

    links: fabric and link by user. The links are valid until the router ends.
    """
    parts = [HEAD]
    for user, (fabric, link) in links.items():
        parts.append(
            f"<section><h2>{escape(user)}</h2>{escape(fabric)}<br>{drawing(link)}"
            f"<p>{escape(link)}</p></section>\n"
        )
    try:
        write_own(path, "".join(parts))
    except OSError as error:
        raise FabricError(
            f"Cannot write {path}, for the links of the class: "
            f"{error.strerror or error}. Free the disk, or start without --pages. "
            "(R0607)"
        ) from None
