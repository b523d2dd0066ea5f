"""The site: built without a warning, read without a network, and searched."""

import importlib
import json
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from html.parser import HTMLParser
from pathlib import Path

import pytest

from rems_net.doors import DOORS
from tests.commands import ROOT, python

sys.path.insert(0, str(ROOT / "docs" / "reference"))
pytestmark = pytest.mark.timeout(300)
HERE = Path(__file__).parent
WORDS: dict[str, list[str]] = tomllib.loads((HERE / "words.toml").read_text("utf-8"))
#: words whose right page must be among the first FIRST of all results
FOUND, FIRST = 27, 3
#: bytes of the site as it is packed in a wheel
MOST = 1_500_000
#: elements, and their attributes with addresses that a browser loads
LOADED = {
    **dict.fromkeys(("script", "img", "iframe", "embed", "source", "video"), "src"),
    **{"link": "href", "object": "data"},
}


class Loads(HTMLParser):
    """Collects the addresses that a browser loads with a page."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        names = (LOADED.get(tag, ""), "srcset", "poster")
        self.found += [given[name] or "" for name in names if name in given]


def test_nothing_is_loaded_from_elsewhere(site: Path) -> None:
    pages = sorted(site.rglob("*.html"))
    assert len(pages) > len(list((ROOT / "docs").glob("*.md")))
    for page in pages:
        reader = Loads()
        reader.feed(page.read_text(encoding="utf-8"))
        for address in reader.found:
            assert not re.search(r"(\w+:)?//", address), f"{page.name}: {address}"
            if (
                path := address.partition("?")[0].partition("#")[0]
            ) and " " not in path:
                assert (page.parent / path).exists(), f"{page.name}: {address}"
    for style in site.rglob("*.css"):
        text = style.read_text(encoding="utf-8")
        for address in re.findall(r"url\(([^)]*)\)|@import ([^;]*)", text):
            assert "//" not in re.sub(r"^.?data:.*", "", "".join(address)), style
    for script in [*site.glob("searchindex.js"), *site.glob("_static/**/*.js")]:
        # Comments and licences may have addresses; nothing may go there.
        text = script.read_text(encoding="utf-8")
        called = r"(?:fetch|import|importScripts|open)\(\s*[\"'`]\w*:?//"
        assert not re.search(called, text), script


def test_the_right_page_is_found(site: Path) -> None:
    """For words of a student, by the search of the site itself."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not on PATH.")
    assert len(WORDS) == 30
    done = subprocess.run(
        [node, HERE / "search.mjs", site, *WORDS],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    results = json.loads(done.stdout)
    lost = {
        word: results[word][:FIRST]
        for word, pages in WORDS.items()
        if not {*results[word][:FIRST]} & {*pages}
    }
    assert len(WORDS) - len(lost) >= FOUND, lost


def test_the_words_name_pages() -> None:
    for word, pages in WORDS.items():
        for page in pages:
            assert (ROOT / f"{page}.md").exists(), f"words.toml: {word}: {page}"


def test_it_is_small(site: Path, tmp_path: Path) -> None:
    packed = tmp_path / "site.zip"
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in site.rglob("*"):
            archive.write(path, path.relative_to(site))
    assert packed.stat().st_size <= MOST


@pytest.mark.parametrize("door", DOORS)
def test_the_reference_has_every_public_name(site: Path, door: str) -> None:
    """Each with an example that runs: its own, or that of a page or of `examples/`."""
    generated = importlib.import_module("generated")
    short = door.rpartition(".")[2]
    text = (site / f"docs/reference/{short}.html").read_text(encoding="utf-8")
    for name in importlib.import_module(door).__all__:
        unit = f'<span class="pre">{name}</span></code></p></td>'
        listed = f'id="{door}.{name}"' in text or unit in text
        assert listed, f"{door}.{name} is not on the page"
        own = name in re.split(", |\n", "\n".join(generated.cells(short)))
        unit_only = short == "units" and f'id="{door}.{name}"' not in text
        assert own or unit_only or generated.uses(f"{door}.{name}"), (
            f"{door}.{name} has no example: write one in docs/reference/{short}.txt"
        )


@pytest.mark.parametrize("door", DOORS)
def test_the_examples_of_the_reference_run(tmp_path: Path, door: str) -> None:
    generated = importlib.import_module("generated")
    files = []
    for i, code in enumerate(generated.cells(door.rpartition(".")[2]).values()):
        files.append(f"cell{i}.py")
        (tmp_path / files[-1]).write_text(code, encoding="utf-8")
    each = "import runpy, sys; [runpy.run_path(name) for name in sys.argv[1:]]"
    done = python(tmp_path, "-c", each, *files)
    assert done.returncode == 0, done.stderr
