"""classroom.md: its links, its sources and its commands are there."""

import re
import shlex
from pathlib import Path

from rems_net.cli.verbs import COMMANDS, NOUNS
from rems_net.client.checkup import SLOW
from tests.pages import rems

DEPLOY = Path(__file__).parents[2] / "deploy"
CLASS = DEPLOY / "classroom.md"


def test_the_page_is_two_pages() -> None:
    assert (
        len(CLASS.read_text(encoding="utf-8").partition("## Sources")[0].split()) < 1100
    )


def test_its_links_lead_somewhere() -> None:
    text = CLASS.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#]+)(?:#([^)]*))?\)", text):
        path, anchor = target
        if "://" not in path:
            assert (DEPLOY / path).exists(), path
            if anchor:
                heads = re.findall(
                    "^#+ (.*)$", (DEPLOY / path).read_text(encoding="utf-8"), re.M
                )
                assert anchor in {h.lower().replace(" ", "-") for h in heads}
    body, _, sources = text.partition("## Sources")
    named = {int(n) for n in re.findall(r"\[([0-9]+)\]", body)}
    listed = [int(n) for n in re.findall(r"^([0-9]+)\. ", sources, re.M)]
    assert sorted(named) == listed == list(range(1, len(listed) + 1))


def test_its_commands_are_there(tmp_path: Path) -> None:
    lines = re.findall(r"`(rems [^`]*)`", CLASS.read_text(encoding="utf-8"))
    assert len(lines) > 4
    for line in lines:
        verb, *words = shlex.split(line)[1:]
        if verb in NOUNS:
            verb, *words = f"{verb} {words[0]}", *words[1:]
        assert verb in COMMANDS, line
        told = rems(tmp_path, f"rems {verb} --help").stdout
        for word in words:
            assert not word.startswith("-") or word in told, line


def test_what_it_says_of_the_doctor() -> None:
    assert f"above {1000 * SLOW:.0f} ms it says" in CLASS.read_text(encoding="utf-8")
