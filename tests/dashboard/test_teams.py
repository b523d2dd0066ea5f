"""The grid of a class: a teacher sees all teams and stops them, a student does not."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.agents.runs import free_port, until
from tests.commands import command, environment
from tests.dashboard.browser import Browser, Chromium

NAMES = """name,team,password
Tess,teachers,red birds fly
Anna,team1,blue birds fly
Cem,team1,green birds fly
Ben,team2,grey birds fly
"""
PASSWORDS = {"anna": "blue birds fly", "ben": "grey birds fly"}
LINK = re.compile(r"http://127\S+")


class Class:
    """A router of a class with a page; a robot of team1; a page of Ben's laptop."""

    def __init__(self, folder: Path):
        self.folder, self._started = folder, list[subprocess.Popen[str]]()
        (folder / "names.csv").write_text(NAMES, encoding="utf-8")
        (folder / "names.csv").chmod(0o600)
        self.at = f"tcp/127.0.0.1:{free_port()}"
        words = ("--class", "names.csv", "--listen", self.at, "--dashboard")
        try:
            self.teacher = self._link(self.start("teacher", "router", "serve", *words))
            clock = self.start("anna", "router", "serve", "--fabric", "team1")
            assert clock.stdout is not None
            assert "Open fabric" in clock.stdout.readline()
            robot = ("woodbot", "kinematic", "--name", "sim", "--fabric", "team1")
            self.start("anna", "agent", "start", "robot", *robot)
            page = self.start("ben", "dashboard", "--no-qr", "--fabric", "rems")
            self.student = self._link(page)
        except BaseException:
            self.close()
            raise

    def start(self, user: str, *words: str) -> subprocess.Popen[str]:
        """Start a command on a user's laptop: with notes and a password of its own."""
        own = self.folder / user
        own.mkdir(mode=0o700, exist_ok=True)
        known = {}
        if user in PASSWORDS:
            known = {"REMS_ROUTER": self.at, "REMS_USER": user}
            known["REMS_PASSWORD"] = PASSWORDS[user]
        process = subprocess.Popen(
            command(*words),
            cwd=self.folder,
            env=environment(XDG_RUNTIME_DIR=str(own), **known),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
        )
        self._started.append(process)
        return process

    def _link(self, process: subprocess.Popen[str]) -> str:
        assert process.stdout is not None
        said = ""
        for line in process.stdout:
            said += line
            if found := LINK.search(line):
                return found.group()
        raise AssertionError(said)

    def close(self) -> None:
        for process in reversed(self._started):
            process.terminate()
            process.communicate()


@pytest.fixture(scope="module")
def school(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Class]:
    made = Class(tmp_path_factory.mktemp("school"))
    try:
        yield made
    finally:
        made.close()


@pytest.fixture(scope="module")
def tab(chromium: Chromium) -> Iterator[Browser]:
    with chromium.apart() as made:
        made.size(1280, 800)
        yield made


def tile(fabric: str) -> str:
    """The text of a team's tile."""
    return f"rems.teams.tiles.get('{fabric}').tile.innerText"


def row(fabric: str) -> str:
    return f"rems.teams.rows.find(r => r.fabric === '{fabric}')"


def test_a_teacher_sees_all_teams_and_stops_one(school: Class, tab: Browser) -> None:
    tab.go(school.teacher)
    tab.until(f"{row('team1')}?.robots === 1")  # the grid comes by itself
    assert tab.run("rems.teams.rows.map(r => r.fabric)") == ["rems", "team1", "team2"]
    tab.until(f"{tile('team1')}.includes('running')")
    text = tab.until(tile("team1"))
    assert "anna; not here: cem" in text
    assert "1 robot" in text
    assert "ben" in tab.run(tile("team2"))
    assert "nothing runs" in tab.run(tile("team2"))
    first = tab.run(f"{row('team1')}.tick")
    tab.until(f"{row('team1')}.tick > {first}")
    tab.click("rems.teams.tiles.get('team1').stop")
    tab.until(f"{tile('team1')}.includes('stopped')")
    tab.until("document.querySelector('#log').innerText.includes('robot/sim stands')")
    assert not tab.run(f"{row('rems')}.stopped")
    tab.click(
        "rems.teams.tiles.get('team1').release",
        hold=f"{tile('team1')}.includes('running')",
    )


def test_a_click_opens_the_page_of_a_team(school: Class, tab: Browser) -> None:
    tab.go(school.teacher)
    tab.until("rems.teams.tiles.has('team1')")
    tab.click("rems.teams.tiles.get('team1').tile.querySelector('a')")
    tab.until("location.search === '?fabric=team1' && window.rems")
    tab.until("rems.store.ports.get('robot/sim/state')?.tick > 0")
    assert tab.run("document.querySelector('#title').textContent") == "team1"
    assert tab.run("document.querySelector('#teams').hidden")
    tab.click("document.querySelector('#stop')")  # of this fabric alone
    tab.until(f"{row('team1')}?.stopped === true && {row('rems')}.stopped === false")
    tab.click(
        "document.querySelector('#release')",
        hold="document.querySelector('#release').hidden",
    )


def test_all_are_stopped_by_keys_alone(school: Class, tab: Browser) -> None:
    tab.go(school.teacher)
    tab.until(f"{row('team1')}?.robots === 1 && rems.teams.tiles.has('team1')")
    tab.run("document.querySelector('#team-tools button').focus()")
    tab.key("Enter", "Enter", "\r")
    tab.until(f"{row('team1')}.stopped && {row('rems')}.stopped")
    tab.click(
        "document.querySelectorAll('#team-tools button')[1]",
        hold=f"!{row('team1')}.stopped && !{row('rems')}.stopped",
    )
    assert tab.errors == []


def test_a_student_sees_the_own_team_and_no_other(school: Class, tab: Browser) -> None:
    tab.go(school.student)
    tab.until("rems.teams.rows.length > 1")
    assert tab.run("rems.teams.rows.map(r => r.fabric)") == ["rems", "team2"]
    assert tab.run("document.querySelector('#teams').hidden")
    said: Any = tab.run(
        "rems.link.ask('stop_teams', {fabrics: ['team1']}).then(JSON.stringify, String)"
    )
    assert "stands" not in said
    foreign = school.student.replace("/#", "/?fabric=team1#")
    tab.go(foreign)
    tab.until("document.querySelector('#notice').innerText.includes('another team')")
    assert tab.run("rems.store.ports.size") == 0
    tab.go(school.teacher)
    tab.until(f"{row('team1')}?.robots === 1")
    assert not tab.run(f"{row('team1')}.stopped")
    until(lambda: not tab.errors)


def test_the_large_stop_is_for_all_while_the_grid_is_shown(
    school: Class, tab: Browser
) -> None:
    """By the space bar, too; it counts robots, and names who has said it."""
    tab.go(school.teacher)
    tab.until(f"{row('team1')}?.robots === 1 && rems.teams.tiles.has('team1')")
    stop = "document.querySelector('#stop')"
    tab.until(f"{stop}.innerText === 'STOP all'")
    release = "document.querySelector('#release')"
    for by_key in (False, True):
        if by_key:
            tab.key(" ", "Space", " ")
        else:
            tab.click(stop)
        tab.until(f"{row('team1')}.stopped && {row('rems')}.stopped")
        lights = "document.querySelector('#lights').innerText"
        tab.until(f"{lights}.includes('STOP holds in 2 of 3: 1 of 1 robots stand')")
        assert "R0618" not in tab.run("document.querySelector('#log').innerText")
        tab.click(release, hold=f"!{row('team1')}.stopped && !{row('rems')}.stopped")
    tab.click("rems.teams.tiles.get('team1').stop")
    tab.until(f"{row('team1')}.stopped")
    tab.go(school.teacher.replace("/#", "/?fabric=team1#"))
    light = "STOP by tess on 127.0.0.1 holds: 1 of 1 robots stand"
    tab.until(f"document.querySelector('#lights').innerText.includes('{light}')")
    tab.click(release, hold=f"{release}.hidden")
