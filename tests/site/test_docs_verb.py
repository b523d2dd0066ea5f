"""`rems docs [WORD]`: which page it opens, and what it says if it cannot."""

import json
import os
import shutil
import sys
import tomllib
from pathlib import Path

import pytest

import rems_net.cli.docs as docs
from rems_net.errors import ExperimentError
from tests.commands import ROOT, Done, finished

pytestmark = pytest.mark.timeout(300)
WORDS: dict[str, list[str]] = tomllib.loads(
    (Path(__file__).parent / "words.toml").read_text("utf-8")
)


@pytest.fixture
def installed(site: Path, tmp_path: Path) -> Path:
    """A folder with the package and its built pages, as a wheel brings them."""
    package = tmp_path / "installed" / "rems_net"
    ignored = shutil.ignore_patterns("site", "__pycache__")
    shutil.copytree(ROOT / "rems_net", package, ignore=ignored)
    shutil.copytree(site, package / "site")
    return package.parent


def rems_docs(folder: Path, *words: str, **more: str) -> Done:
    """Type `rems docs` with the package of this folder, without a browser."""
    env = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "BROWSER")}
    env |= {"PYTHONPATH": str(folder), "PATH": str(folder)} | more
    code = ["-S", "-c", "from rems_net.cli import main; raise SystemExit(main())"]
    return finished([sys.executable, *code, "docs", *words], folder, env)


def test_a_browser_opens_the_page(installed: Path) -> None:
    if os.name != "posix":
        pytest.skip("there is no `sh` here")
    browser, seen = installed / "browser", installed / "seen"
    browser.write_text(f'#!/bin/sh\necho "$1" > {seen}\n', encoding="utf-8")
    browser.chmod(0o755)
    done = rems_docs(installed, "camera", BROWSER=f"{browser} %s")
    assert (done.returncode, done.stderr) == (0, "")
    page = seen.read_text(encoding="utf-8").strip().partition("#")[0]
    assert page == (installed / "rems_net/site/docs/camera.html").as_uri()


def test_without_a_browser(installed: Path) -> None:
    if sys.platform in ("win32", "darwin"):
        pytest.skip("Windows and macOS always have a browser")
    done = rems_docs(installed)
    page = installed / "rems_net" / "site" / "README.html"
    assert (done.returncode, done.stdout) == (0, "")
    assert done.stderr == (
        f"rems: no browser was found; open this page in one: {page}\n"
    )


def test_a_word_that_no_page_has(installed: Path) -> None:
    done = rems_docs(installed, "raouter")
    assert done.returncode == 2
    assert "no page has the word 'raouter'. Did you mean 'router'?" in done.stderr


def test_an_installation_without_pages(installed: Path) -> None:
    shutil.rmtree(installed / "rems_net" / "site")
    done = rems_docs(installed)
    assert (done.returncode, done.stdout) == (2, "")
    assert "this installation has no pages. Type: pip install" in done.stderr


def test_a_checkout_without_sphinx(installed: Path) -> None:
    shutil.rmtree(installed / "rems_net" / "site")
    shutil.copytree(ROOT / "docs", installed / "docs")
    done = rems_docs(installed)
    assert (done.returncode, done.stdout) == (2, "")
    assert f"read them in {installed / 'docs'}, or type: pip install" in done.stderr


def test_the_best_page(site: Path) -> None:
    """For two of three words it is the one that was chosen for the search."""
    best = {word: docs.best(site, word).partition("#")[0] for word in WORDS}
    wrong = {
        word: best[word]
        for word, pages in WORDS.items()
        if best[word].removesuffix(".html") not in pages
    }
    assert len(wrong) <= len(WORDS) // 3, wrong
    assert all((site / page).exists() for page in best.values())


@pytest.mark.parametrize(
    ("word", "page"),
    [
        ("Hinge", "docs/reference/bodies.html#rems_net.bodies.Hinge"),
        ("Experiment", "docs/reference/rems_net.html#rems_net.Experiment"),
        ("Cameras", "docs/camera.html"),
    ],
)
def test_a_name_of_the_reference(site: Path, word: str, page: str) -> None:
    assert docs.best(site, word) == page


def test_no_word(site: Path) -> None:
    with pytest.raises(ExperimentError, match="All pages: rems docs"):
        docs.best(site, "qqqqq")


def test_the_folder_that_pip_noted(tmp_path: Path) -> None:
    """An installation from a folder finds the pages there."""
    package = tmp_path / "site-packages"
    shutil.copytree(
        ROOT / "rems_net",
        package / "rems_net",
        ignore=shutil.ignore_patterns("site", "__pycache__"),
    )
    noted = package / "rems_net-0.1.0.dist-info"
    noted.mkdir()
    (noted / "METADATA").write_text("Name: rems-net\nVersion: 0.1.0\n")
    source = tmp_path / "my checkout"
    shutil.copytree(ROOT / "docs", source / "docs")
    (noted / "direct_url.json").write_text(json.dumps({"url": source.as_uri()}))
    done = rems_docs(package)
    assert f"read them in {source / 'docs'}, or type" in done.stderr
