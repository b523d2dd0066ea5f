"""Checkup: laptops, clocks and agents that do not go together, made and told."""

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from rems_net import __version__
from rems_net.client.checkup import check_up
from rems_net.router.mail import Question
from rems_net.router.message import pack
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import free_port, until
from tests.commands import environment

#: a laptop that is another in one thing: this is run first, and then `rems ...`
OTHER = (
    "import sys, time, rems_net; {}; from rems_net.cli import main; sys.exit(main())"
)
CART = """\
from rems_net import Definition, In, Out, Schema
from rems_net.defdict import length, velocity


class Cart(Definition):
    command = In(Schema("command", {"speed": velocity()}))
    state = Out(Schema("state", {"x": length()}))

    def derivative(self, state, command):
        return {"x": FACTOR * command["speed"]}
"""


@contextmanager
def rems(
    folder: Path, *words: str, other: str = "pass"
) -> Iterator[subprocess.Popen[str]]:
    """`rems words...` in that folder, on a laptop that is `other`."""
    folder.mkdir(exist_ok=True)
    process = subprocess.Popen(
        [sys.executable, "-W", "error", "-c", OTHER.format(other), *words],
        cwd=folder,
        env=environment(),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        encoding="utf-8",
    )
    try:
        yield process
    finally:
        process.terminate()
        process.wait(20)


@pytest.fixture
def session(monkeypatch: pytest.MonkeyPatch) -> Iterator[Session]:
    """A session at a router that all that is started here finds."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with Session(Link(endpoint, serve=True)), Session(Link(endpoint)) as session:
        monkeypatch.setenv("REMS_ROUTER", endpoint)
        yield session


def bad(session: Session) -> list[str]:
    return [one.sentence for one in check_up(session) if not one.well]


def test_a_clock_of_another_version(tmp_path: Path, session: Session) -> None:
    with rems(tmp_path, "router", "serve", other="rems_net.__version__ = '0.0.9'"):
        until(lambda: session.who("rems/clock/@alive"), 60.0)
        until(lambda: "0.0.9" in "".join(bad(session)), 60.0)
        assert bad(session) == [
            f"its clock has rems_net 0.0.9, and this laptop {__version__}. Type here: "
            f'pip install "rems-net==0.0.9"; or there: pip install '
            f'"rems-net=={__version__}"'
        ]


@pytest.mark.parametrize(
    ("seconds", "says"), [(3600, "60 min ahead of"), (-40, "40 s behind")]
)
def test_a_system_time_that_is_off(
    tmp_path: Path, session: Session, seconds: int, says: str
) -> None:
    off = f"now = time.time; time.time = lambda: now() + {seconds}"
    with rems(tmp_path, "router", "serve", other=off):
        until(lambda: session.who("rems/clock/@alive"), 60.0)
        until(lambda: "system time" in "".join(bad(session)), 60.0)
        assert bad(session) == [
            f"the system time of its clock's laptop is {says} that of this one: set "
            "both from the internet. The fabric has its own time; dates of files, and "
            "TLS, go wrong"
        ]


def test_definitions_that_differ_and_names_that_are_there_twice(
    tmp_path: Path, session: Session
) -> None:
    """Of two laptops with a `cart.py` each; then a stranger answers for one robot."""
    words = ("agent", "start", "robot", "cart.py:Cart", "kinematic", "--name")
    files = {}
    for name, factor in (("alice", 1), ("bob", 2), ("carol", 1)):
        files[name] = tmp_path / name
        files[name].mkdir()
        (files[name] / "cart.py").write_text(CART.replace("FACTOR", str(factor)))

    def present(*names: str) -> bool:
        found = session.who("rems/robot/*/@alive")
        asked = {mail.key for mail in session.ask("rems/*/*/@why")}
        return len(found) == len(names) == len(asked)

    with rems(tmp_path, "router", "serve"), rems(files["alice"], *words, "alice"):
        with rems(files["carol"], *words, "carol"):
            until(lambda: present("alice", "carol"), 60.0)
            assert "Cart" not in "".join(one.sentence for one in check_up(session))
        with rems(files["bob"], *words, "bob"):
            until(lambda: present("alice", "bob"), 60.0)
            assert bad(session) == []
            assert list(check_up(session))[-1].sentence == (
                "robot/alice and robot/bob are both a Cart, by files that differ; if "
                "they are to be alike, copy the file from one laptop to the other, and "
                "start both anew"
            )
        until(lambda: present("alice"), 60.0)
        with Session(session.link) as stranger:
            stranger.answer_at_once(
                "rems/robot/alice/@schema",
                lambda q: q.answer("rems/robot/alice/@schema", pack({})),
            )
            until(lambda: bad(session), 60.0)
            assert bad(session) == [
                "2 programs answer for robot/alice: end all but one, or give it "
                "another --name"
            ]


@pytest.mark.parametrize(
    "said",
    [
        b"",
        b"[]",
        b"[" * 100_000,
        b'{"version": 3, "now": "noon"}',
        b'{"version": "\\u001b[2J", "now": NaN, "made_of": [1]}',
        json.dumps({"version": "9" * 10_000, "now": 1e400}).encode(),
    ],
)
def test_a_stranger_that_says_anything(session: Session, said: bytes) -> None:
    def answer(question: Question) -> None:
        question.answer(question.key.replace("*", "x"), said)

    with Session(session.link) as stranger:
        stranger.present("rems/clock/@run/1")
        stranger.present("rems/robot/x/@alive")
        for key in ("clock/@age", "clock/@why", "robot/x/@why", "robot/x/@schema"):
            stranger.answer_at_once(f"rems/{key}", answer)
        until(lambda: session.who("rems/robot/x/@alive"))
        for finding in check_up(session):
            assert finding.sentence.isprintable()
            assert len(finding.sentence) < 300
