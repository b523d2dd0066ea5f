"""What `rems agent bring` asks, what it trusts unasked, and what a run learns."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from rems_net.agents.experiment.placement.bring import REFUSED
from rems_net.agents.experiment.placement.needs import source_digest
from rems_net.agents.protocol.placement import File, read_caller
from rems_net.errors import FabricError
from rems_net.router.gate import access
from rems_net.router.gate.identity import answer_for, vouches
from rems_net.router.gate.users import Users
from rems_net.router.mail import Question
from rems_net.router.message import pack
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import free_port
from tests.cli.conftest import KEYS
from tests.cli.placement.conftest import ON_B, Pair, ended, one_line, wait_for
from tests.cli.placement.test_attacks import SERIAL, play, robot
from tests.commands import rems
from tests.interrupts import interrupt

SECRET = "a-password-of-mine"


def test_a_password_stays_where_it_is(pair: Pair) -> None:
    """A one-line file of mode 600, which an earlier refusal quoted to the sender."""
    anna, ben = pair
    secret = ben.folder / "secret.txt"
    secret.write_text(SECRET)
    secret.chmod(0o600)
    troubles: list[str] = []

    def start(question: Question) -> None:
        troubles.append(read_caller(question.payload).trouble)
        file = str(secret) if len(troubles) % 3 else "../secret.txt"
        offer = play(file, files={})
        question.answer("rems/machine/b/@start", offer.to_wire())

    heard: list[bytes] = []
    with Session(Link(anna.environment["REMS_ROUTER"])) as session:
        session.watch_at_once("**", lambda mail: heard.append(mail.payload))
        session.answer_at_once("rems/machine/b/@start", start)
        session.present("rems/machine/b/@start")
        for _ in range(2):
            status, _, error = ended(ben.bring("--as", "b"))
            assert status == 2
            assert "nothing else of this laptop is opened" in error
    assert troubles == ["", REFUSED, "", REFUSED]
    assert SECRET.encode() not in b"".join(heard)


def test_no_answer_but_yes_starts_anything(pair: Pair) -> None:
    """Nor --yes, where anybody can take any name; and Ctrl+C ends it quietly."""
    anna, ben = pair
    anna.write(lab_toml=ON_B, data__keys_csv=KEYS)
    run = anna.start("run", "lab.toml")
    wait_for(run, "rems agent bring")
    asked = [ben.bring("--as", "b", typed=typed) for typed in ("yes, but\n", "\x04")]
    held = ben.bring("--as", "b", typed="")
    blind = ben.start("agent", "bring", "--as", "b", "--yes")
    for one in asked:
        status, out, error = ended(one)
        assert status == 2
        assert error == "rems: nothing is started: the answer was not y. (R0443)\n"
        assert "  robot/model  Woodbot done by Kinematic\n" in out
    status, _, error = ended(blind)
    assert status == 2
    assert "is open to others, so nobody knows whose run this is" in error
    wait_for(held, "Anybody at this router")
    interrupt(held)
    status, _, error = ended(held)
    assert (status, error) == (130, "")
    interrupt(run)
    assert REFUSED in one_line(ended(run)[1])


@pytest.fixture
def ben() -> Iterator[Link]:
    """Ben's link, of team1, at a router with users, and with an answer for them."""
    users = Users(
        {access.MEMBERS: ["teacher"], access.GUESTS: []},
        dict.fromkeys(("teacher", "ben", "clara"), "p" * 12),
        {"team1": ["ben"], "team2": ["clara"]},
    )
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with Session(Link(endpoint, serve=True, users=users)) as session:
        session.answer_at_once(f"{access.WHO}/*", answer_for(users, "rems"))
        yield Link(endpoint, fabric="team1", user="ben", password="p" * 12)


def test_a_router_with_users_vouches_for_ones_team(ben: Link) -> None:
    for link, known in (
        (ben, True),
        (replace(ben, fabric="team1-x"), True),
        (replace(ben, fabric="rems"), False),
        (replace(ben, user="teacher"), False),
    ):
        with Session(link) as session:
            assert vouches(session) == known, link


def test_an_open_router_vouches_for_nobody(ben: Link) -> None:
    """There anybody could answer for the router; so nobody with a name is let in."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with Session(Link(endpoint, serve=True)) as session:
        session.answer_at_once(
            f"{access.WHO}/**", lambda q: q.answer(q.key, pack(["", "team1", "rems"]))
        )
        with Session(Link(endpoint, fabric="team1")) as other:
            assert not vouches(other)
        with pytest.raises(FabricError, match="does not let 'ben' in"):
            Session(replace(ben, endpoint=endpoint)).open()


def test_a_script_starts_what_its_team_asks_for(ben: Link, tmp_path: Path) -> None:
    """A port has to be named; and what fails here is said on this screen alone."""
    data = b"its first line\n"
    files = {"keys.csv": File(len(data), source_digest(data))}
    port = robot(SERIAL, options={"port": "/dev/ttyS0"})
    both = (port, play("keys.csv"))
    offers = [offer._replace(files=files).to_wire() for offer in both]
    troubles: list[str] = []

    def start(question: Question) -> None:
        troubles.append(read_caller(question.payload).trouble)
        question.answer("team1/machine/b/@start", offers[len(troubles) > 2])

    known = {"REMS_USER": ben.user, "REMS_PASSWORD": ben.password}
    words = ("agent", "bring", "--as", "b", "--yes", "--fabric", "team1")
    with Session(ben) as session:
        where = f"team1/machine/b/@file/{files['keys.csv'].digest}"
        session.answer_at_once("team1/machine/b/@start", start)
        session.answer_at_once(where, lambda question: question.answer(where, data))
        session.present("team1/machine/b/@start")
        for status, sentence in (
            (2, "with --yes such is named, too: --allow /dev/ttyS0 (R0443)\n"),
            (1, "but the columns are 'its first line'."),
        ):
            done = rems(tmp_path, *words, REMS_ROUTER=ben.endpoint, **known)
            assert done.returncode == status
            assert sentence in done.stderr.splitlines()[-1] + "\n"
    assert troubles == ["", REFUSED, "", REFUSED]


BREAKS = """\
from rems_net import Out, Process, Schema
from rems_net.defdict import number


class Count(Process):
    value = Out(Schema("count.value", {"x": number()}))

    def step(self, tick):
        if tick.n == 3:
            raise OSError("what is in a file of mine")
"""
BREAKING = """\
[experiment]
duration = "1 s"

[[process]]
name = "count"
type = "count.py:Count"
machine = "b"
"""


def test_what_fails_in_a_run_is_said_here(pair: Pair) -> None:
    """After the run has begun its clock learns which agent failed, and no more."""
    anna, ben = pair
    for laptop in pair:
        laptop.write(lab_toml=BREAKING, count_py=BREAKS)
    run = anna.start("run", "lab.toml")
    status, _, error = ended(ben.bring("--as", "b"))
    assert status == 1
    assert error.count("what is in a file of mine") == 2
    status, out, error = ended(run)
    assert status == 1
    assert error.splitlines()[-1] == (
        "rems: process/count: failed on the machine that brought it, whose screen "
        "shows why"
    )
    assert "what is in" not in out
