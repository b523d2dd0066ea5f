"""`rems docs [WORD]`: the pages, in the browser."""

import argparse
import importlib.metadata
import json
import shutil
import subprocess
import sys
import tempfile
import webbrowser
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlparse
from urllib.request import url2pathname

from rems_net.cli.options import warn
from rems_net.errors import ExperimentError, MissingPartError, nearest

EXAMPLES = """\
examples:
  rems docs              the first page
  rems docs camera       the page about cameras
  rems docs Hinge        the class in the reference
"""
FIRST = "README.html"
PACKAGE = Path(__file__).parents[1]
#: weight of a word where it stands: name of a page, its title, a heading, the index,
#: which has each word for three pages, and twice for the best of them
NAME, TITLE, HEADING, INDEX = 100, 50, 20, 30
#: weight of a public name in the reference, as typed and with other capitals
EXACT, SAME = 200, 5


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "word", metavar="WORD", nargs="?", default="", help="such as camera"
    )


def run(args: argparse.Namespace) -> int:
    """Open the best page, or print its path if there is no browser."""
    folder = site()
    page = best(folder, args.word) if args.word else FIRST
    path, _, place = page.partition("#")
    address = (folder / path).as_uri() + (f"#{place}" if place else "")
    if not webbrowser.open(address):
        warn(f"no browser was found; open this page in one: {folder / path}")
    return 0


def site() -> Path:
    """Return the folder of the built pages; build them if they are out of date.

    Raises MissingPartError if they are not built, and cannot be.
    """
    source = checkout()
    folder = (source / "rems_net" if source else PACKAGE) / "site"
    built = folder / FIRST
    if source is None:
        if built.exists():
            return folder
        raise MissingPartError(
            "this installation has no pages. Type: pip install --force-reinstall "
            "rems-net (R1002)"
        )
    pages = [*source.glob("*.md"), *source.glob("docs/**/*"), *source.glob("deploy/*")]
    newest = max(path.stat().st_mtime for path in pages)
    if built.exists() and built.stat().st_mtime >= newest:
        return folder
    if find_spec("furo") and find_spec("myst_parser"):
        build(source, folder)
    elif not built.exists():
        raise MissingPartError(
            f"the pages are not built; read them in {source / 'docs'}, or type: "
            f'pip install "rems-net[docs]" (R0301)'
        )
    return folder


def checkout() -> Path | None:
    """Return the folder with the sources of this installation, if it is here."""
    folder = PACKAGE.parent
    if not (folder / "docs" / "conf.py").exists():
        try:
            # pip notes the folder from which it installed.
            noted = importlib.metadata.distribution("rems-net")
            said = json.loads(noted.read_text("direct_url.json") or "{}")
        except (importlib.metadata.PackageNotFoundError, ValueError):
            return None
        parts = urlparse(str(said.get("url", "")))
        folder = Path(url2pathname(unquote(parts.path)))
        if parts.scheme != "file" or not (folder / "docs" / "conf.py").exists():
            return None
    return folder


def build(source: Path, folder: Path) -> None:
    """Build the pages by Sphinx. Raises ExperimentError if that fails."""
    warn("building the pages, which takes half a minute the first time")
    with tempfile.TemporaryDirectory() as made:
        words = ["-q", "-d", f"{made}/doctrees", "-c", str(source / "docs")]
        done = subprocess.run(
            [sys.executable, "-m", "sphinx", *words, str(source), f"{made}/site"],
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            last = (done.stderr.strip() or "no reason is given").splitlines()[-1]
            raise ExperimentError(f"Sphinx cannot build the pages: {last} (R0914)")
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(f"{made}/site", folder)


def best(folder: Path, word: str) -> str:
    """Return the page that explains a word best, with its place there after a `#`.

    It uses the index of the site's own search. Raises ExperimentError if no page has
    the word.
    """
    text = (folder / "searchindex.js").read_text(encoding="utf-8")
    index: dict[str, Any] = json.loads(text.partition("(")[2].rpartition(")")[0])
    points: dict[int, int] = {}
    places: dict[int, tuple[int, str]] = {}
    for page, weight, place in _found(index, word):
        points[page] = points.get(page, 0) + weight
        if weight > places.get(page, (0, ""))[0]:
            places[page] = weight, place
    if not points:
        known = [*index["indexentries"], *(name for _, name, *_ in _objects(index))]
        raise ExperimentError(
            f"no page has the word {word!r}.{nearest(word, known)} All pages: "
            "rems docs (R0914)"
        )
    page = max(points, key=lambda one: points[one])
    name, place = index["docnames"][page], places[page][1]
    return f"{name}.html#{place}" if place else f"{name}.html"


def _found(index: dict[str, Any], word: str) -> Iterator[tuple[int, int, str]]:
    """Yield the places of a word: number of the page, weight, and place there."""
    low = word.lower()
    forms = {low, low.removesuffix("s"), f"{low}s"}
    for page, name in enumerate(index["docnames"]):
        if forms & {*name.lower().rpartition("/")[2].split("_")}:
            yield page, NAME, ""
    for title, found in index["alltitles"].items():
        if forms & {one.strip(".,:?!()`").lower() for one in title.split()}:
            for page, place in found:
                yield page, HEADING if place else TITLE, place or ""
    for form in forms:
        for page, *_ in index["indexentries"].get(form, ()):
            yield page, INDEX, ""
    for page, name, place in _objects(index):
        if name.lower() == low:
            yield page, EXACT if name == word and name != low else SAME, place


def _objects(index: dict[str, Any]) -> Iterator[tuple[int, str, str]]:
    """Yield page, name and place of the names in the reference."""
    for prefix, names in index["objects"].items():
        for page, _, _, place, name in names:
            yield page, name, place if place not in ("", "-") else f"{prefix}.{name}"
