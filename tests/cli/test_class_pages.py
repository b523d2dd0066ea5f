"""The pages of a class: one for each user, and each with the rights of its user."""

import json
import re
from html import unescape
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from websockets.sync.client import ClientConnection, connect

from rems_net.cli.sheet import write_sheet
from rems_net.errors import FabricError
from tests.agents.runs import free_port, until
from tests.cli.conftest import FREE
from tests.commands import Run, Start

NAMES = """name,team,password
Tess,teachers,red birds fly
Anna,team1,blue birds fly
Ben,team2,grey birds fly
"""


class Page:
    """A page without a browser."""

    def __init__(self, socket: ClientConnection, token: str):
        self._socket = socket
        self.status: dict[str, Any] = {}
        socket.send(json.dumps({"hello": token, "version": 1}))
        self.welcome = self._next("welcome")

    def _next(self, member: str) -> dict[str, Any]:
        while True:
            text = self._socket.recv(20)
            found = json.loads(text) if isinstance(text, str) else {}
            self.status = found.get("status", self.status)
            if member in found:
                one: dict[str, Any] = found[member]
                return one

    def ask(self, verb: str, **more: Any) -> dict[str, Any]:
        """Return the answer to a request."""
        self._socket.send(json.dumps({"do": verb, "id": 1, **more}))
        return self._next("answer")

    def until_it_shows(self, agent: str) -> None:
        while agent not in [row[0] for row in self.status.get("agents", [])]:
            self._next("status")


def page(link: str) -> tuple[Any, str]:
    parts = urlsplit(link)
    origin: Any = f"http://{parts.netloc}"
    # With a limit on unread messages, `close` would wait for ten seconds.
    more: Any = {"origin": origin, "compression": None, "max_queue": None}
    return connect(f"ws://{parts.netloc}/", **more), parts.fragment


def test_a_students_page_commands_the_own_team_only(
    start: Start, rems: Run, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "names.csv").write_text(NAMES, encoding="utf-8")
    (folder / "names.csv").chmod(0o600)
    at = f"tcp/127.0.0.1:{free_port()}"
    start("router", "serve", "--class", "names.csv", "--listen", at, "--pages")
    sheet = folder / "names.pages.html"
    until(sheet.exists)
    assert sheet.stat().st_mode & 0o077 == 0
    found = re.findall(
        r"<h2>(\S+)</h2>.*?<p>(\S+)</p>", sheet.read_text("utf-8"), re.DOTALL
    )
    links = {user: unescape(link) for user, link in found}
    assert sorted(links) == ["anna", "ben", "tess"]
    assert len({urlsplit(link).fragment for link in links.values()}) == 3
    (folder / "free.toml").write_text(FREE, encoding="utf-8")
    monkeypatch.setenv("REMS_ROUTER", at)
    monkeypatch.setenv("REMS_USER", "tess")
    monkeypatch.setenv("REMS_PASSWORD", "red birds fly")
    for team in ("team1", "team2"):
        start("run", "free.toml", "--fabric", team, "--out", team)

    opened = {user: page(link) for user, link in links.items()}
    with opened["anna"][0] as one, opened["ben"][0] as two, opened["tess"][0] as three:
        anna = Page(one, opened["anna"][1])
        ben, tess = Page(two, opened["ben"][1]), Page(three, opened["tess"][1])
        seen = [(p.welcome["user"], p.welcome["fabric"]) for p in (anna, ben, tess)]
        assert seen == [("anna", "team1"), ("ben", "team2"), ("tess", "rems")]
        for student in (anna, ben):
            student.until_it_shows("robot/bot")
        # The own robot obeys, and the other team's does not notice.
        assert anna.ask("drive", agents=["robot/bot"])["result"] == ["robot/bot"]
        assert "stands" in str(anna.ask("stop")["result"])
        assert ben.ask("why", key="team2/robot/bot/state")["result"]
        assert "STOP on" not in rems("list", "--fabric", "team2").stdout
        assert "by anna (team1)" in rems("list", "--fabric", "team1").stdout
        # A page cannot even ask at another team's fabric.
        for key in ("team2/robot/bot/state", "team2/robot/bot/command"):
            assert "error" in anna.ask("why", key=key)
        assert "error" in anna.ask("drive", agents=["team2/robot/bot"])


def test_pages_need_a_list_of_users(rems: Run, folder: Path) -> None:
    done = rems("router", "serve", "--pages")
    assert done.returncode == 2
    assert "--class names.csv --pages (R0904)" in done.stderr


def test_a_sheet_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(FabricError, match="for the links of the class"):
        write_sheet(tmp_path / "no" / "sheet.html", {"<b>": ("team1", "http://x/#y")})
    write_sheet(tmp_path / "sheet.html", {"<b>": ("team1", "http://x/#y")})
    assert "<b>" not in (tmp_path / "sheet.html").read_text("utf-8")
