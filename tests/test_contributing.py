"""What the files for those who carry the project on name is there."""

import re

import pytest

from rems_net import __version__
from tests.commands import ROOT

CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")


def test_the_tests_that_it_names_are_there() -> None:
    named = {*re.findall(r"`?(tests/[\w./]+)", CONTRIBUTING)}
    modules = re.findall(r"-m (tests\.[\w.]+)", CONTRIBUTING)
    named |= {module.replace(".", "/") for module in modules}
    assert len(named) > 20
    for name in named:
        path = ROOT / name.rstrip(".")
        assert path.exists() or path.with_suffix(".py").exists(), name


def test_the_rooms_that_it_names_are_there() -> None:
    rows = re.findall(r"^\| (`.*?) \|", CONTRIBUTING, re.MULTILINE)
    for name in re.findall(r"`([^`]+)`", " ".join(rows)):
        assert (ROOT / "rems_net" / name).exists(), name


@pytest.mark.parametrize("page", ["CONTRIBUTING.md", "CHANGELOG.md"])
def test_links_lead_somewhere(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", text.replace("\n", " ")):
        assert "://" in target or (ROOT / target).exists(), target


def test_the_version_is_the_same_everywhere() -> None:
    cited = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {__version__}\n" in cited
    assert f"\n## {__version__}\n" in (ROOT / "CHANGELOG.md").read_text("utf-8")
    packed = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert f'\nversion = "{__version__}"\n' in packed
