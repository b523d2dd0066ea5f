"""A router with users: who is let in, and what the router itself refuses."""

import os
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from rems_net.agents.experiment.file import load as experiment
from rems_net.agents.host.outlet import CROWD
from rems_net.errors import FabricError
from rems_net.router.gate import access
from rems_net.router.gate.identity import answer_for
from rems_net.router.gate.users import load
from rems_net.router.mail import Mail, Mailbox
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import free_port, until
from tests.commands import ROOT, inside, rems
from tests.router.conftest import ANNA, TEAM, asks, empty


@pytest.fixture
def router(file: Path) -> Iterator[str]:
    """A router with these users, in this process; its endpoint."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with Session(Link(endpoint, serve=True, users=load(file))) as session:
        who = answer_for(load(file), "rems")
        session.answer_at_once(f"{access.WHO}/*", who)
        yield endpoint


@pytest.fixture
def member(router: str) -> Iterator[Session]:
    with Session(Link(router, user="anna", password=ANNA)) as session:
        yield session


@pytest.fixture
def guest(router: str) -> Iterator[Session]:
    with Session(Link(router, user="team1", password=TEAM)) as session:
        yield session


# -- what a guest may do -------------------------------------------------------------

REFUSED = [
    "rems/clock/tick",
    "rems/clock/roster",
    "rems/clock/done",
    "rems/clock/report",
    "rems/robot/sim/state",
    "rems/robot/sim/sensors",
    "rems/robot/sim/command/wheel",
    "rems/input/keys/value",
    "rems/process/p/value",
    "rems/output/log/value",
    "team7/clock/tick",
    # Nor by a glob, which would come to whoever watches one of its keys.
    "rems/**",
    "**",
    "rems/*/tick",
    "rems/robot/**",
    "rems/*/*/command",
]
ALLOWED = ["rems/robot/sim/command", "rems/robot/*/command", "rems/stop", "team7/stop"]


def test_what_a_guest_puts(member: Session, guest: Session) -> None:
    """What is refused is dropped by the router; his robot's command passes."""
    heard = Mailbox()
    keys = [k for k in (*REFUSED, *ALLOWED) if "*" not in k]
    for key in keys:
        member.watch(key, heard)
    member.watch("rems/last", heard)
    publisher = guest.publisher("rems/robot/sim/command")
    until(lambda: publisher.watched)
    for key in (*REFUSED, *ALLOWED):
        guest.put(key, key.encode())
    # A session's messages stay in order: what comes after this came in spite of it.
    publisher.put(b"last")
    got: set[str] = set()
    while True:
        mail = heard.get(20.0)
        assert isinstance(mail, Mail)
        if mail.payload == b"last":
            break
        got.add(mail.payload.decode())
    assert got == set(ALLOWED)


def test_a_member_puts_anything(member: Session, guest: Session) -> None:
    heard = Mailbox()
    keys = [k for k in (*REFUSED, *ALLOWED) if "*" not in k]
    guest.watch("rems/**", heard)
    guest.watch("team7/**", heard)
    publishers = [member.publisher(key) for key in keys]
    until(lambda: all(p.watched for p in publishers))
    for publisher in publishers:
        publisher.put(b"x")
    got = set()
    for _ in keys:
        mail = heard.get(20.0)
        assert isinstance(mail, Mail)
        got.add(mail.key)
    assert got == set(keys)


def test_what_a_guest_asks(member: Session, guest: Session) -> None:
    allowed = [
        "rems/clock/roster",
        "rems/clock/@age",
        "rems/robot/sim/@stopped",
        "rems/robot/sim/state",
        "rems/robot/sim/@schema",
        "rems/robot/sim/@call/reset",
        "rems/robot/sim/@where",
    ]
    refused = [
        "rems/clock/@join",
        "rems/clock/@leave",
        "rems/clock/@call/end",
        "rems/process/p/@call/reset",
    ]
    asks(guest, member, allowed, refused)
    for key in refused:
        assert guest.ask(key.replace("rems", "*"), timeout=0.5) == []


def test_a_guest_answers_for_nobody_and_is_nobody(
    member: Session, guest: Session
) -> None:
    guest.answer_at_once("rems/robot/sim/state", empty)
    guest.present("rems/clock/@alive")
    member.present("rems/robot/sim/@alive")
    until(lambda: guest.who("rems/*/*/@alive") == ["rems/robot/sim/@alive"])
    assert member.ask("rems/robot/sim/state", timeout=0.5) == []
    assert member.who("rems/clock/@alive", timeout=0.5) == []


def test_every_machine_chunk_is_in_the_table() -> None:
    """Zenoh's `**` does not match them: one that is not named is refused to all."""
    found = set()
    for path in (ROOT / "rems_net").rglob("*.py"):
        if path.name != "access.py" and path.parent.name != "defdict":
            found |= set(re.findall(r'["/](@[a-z]+)\b', path.read_text("utf-8")))
    assert found
    # The calls of a robot, and the poses of ghosts, are ports within a process, and no
    # keys; in the event of a call, a command and STOP have a name that no verb has.
    assert found - {"@calls", "@ghosts", "@put", "@hold"} <= set(access.MACHINERY)


# -- who is let in -------------------------------------------------------------------


def refusal(link: Link) -> str:
    with pytest.raises(FabricError) as caught:
        Session(link).open()
    assert ANNA not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(
    ("user", "password"), [("anna", TEAM), ("anne", ANNA), ("anna", "")]
)
def test_a_wrong_name_or_password(router: str, user: str, password: str) -> None:
    link = Link(router, user=user, password=password, timeout=0.3)
    assert refusal(link) == (
        f"The router at {router} does not let {user!r} in: the name or the password is "
        "wrong; type `rems router use` with --user once more, or set REMS_USER and "
        "REMS_PASSWORD to yours. If it is open, forget them: rems router forget, "
        "or unset REMS_USER REMS_PASSWORD"
        " (R0606)"
    )


def test_no_name(router: str) -> None:
    assert refusal(Link(router, timeout=0.3)) == (
        f"Something listens at {router}, but does not let this program in. A router "
        "with a class list needs your name: type `rems router use` with "
        "--user NAME, or set REMS_USER and REMS_PASSWORD to yours. (R0606)"
    )


def test_a_password_is_shown_by_nothing(file: Path) -> None:
    link = Link("tcp/127.0.0.1:1", user="anna", password=ANNA, users=load(file))
    assert ANNA not in repr(link) + str(link) + repr(load(file))
    assert TEAM not in repr(link)
    assert "team1" in repr(link)


def test_the_passwords_lie_in_no_file(router: str) -> None:
    """Zenoh reads them from one, which is gone when the router is there."""
    for path in Path(os.environ["XDG_RUNTIME_DIR"]).rglob("*"):
        assert not path.is_file(), path


# -- whole runs ----------------------------------------------------------------------

LAB = """\
[experiment]
dt = "10 ms"
duration = "1 s"
record = false
[[robot]]
name = "a"
definition = "woodbot"
driver = "kinematic"
[[output]]
name = "log"
type = "csv"
host = "here"
"""


def test_a_run_with_a_user_writes_the_same_bytes(router: str, tmp_path: Path) -> None:
    (tmp_path / "lab.toml").write_text(LAB)
    known = {"REMS_ROUTER": router, "REMS_USER": "anna", "REMS_PASSWORD": ANNA}
    words = "run", "lab.toml", "--out"
    for done in (
        rems(tmp_path, *words, "with", **known),
        inside(*words, "without", "--direct", folder=tmp_path),
    ):
        assert (done.returncode, done.stderr) == (0, "")
    files = [tmp_path / out / "a.csv" for out in ("with", "without")]
    assert files[0].read_bytes() == files[1].read_bytes()


def test_a_crowd_comes_in_one_message_to_a_user(
    router: str, member: Session, tmp_path: Path
) -> None:
    """The router lets it through: else each value would be asked for by its key."""
    robot = '[[robot]]\nname = "b{}"\ndefinition = "woodbot"\ndriver = "kinematic"\n'
    head = '[experiment]\ndt = "10 ms"\nduration = "50 ms"\n'
    head += '[[output]]\nname = "log"\ntype = "csv"\n'
    many = [robot.format(i) + 'host = "many"\n' for i in range(CROWD + 1)]
    (tmp_path / "lab.toml").write_text(head + "".join(many))
    known = {"REMS_ROUTER": router, "REMS_USER": "anna", "REMS_PASSWORD": ANNA}
    member.watch("*/robot/@step/*", heard := Mailbox())
    done = rems(tmp_path, "run", "lab.toml", "--out", "with", **known)
    assert done.returncode == 0, done
    seen = [mail.key for mail in heard.letters(1000) if isinstance(mail, Mail)]
    assert [key.partition("/")[2] for key in seen] == 5 * [
        f"robot/@step/{port}" for port in ("command", "state", "sensors")
    ]
    experiment(tmp_path / "lab.toml").run(tmp_path / "direct", direct=True)
    files = [tmp_path / out / "run.mcap" for out in ("with", "direct")]
    assert files[0].read_bytes() == files[1].read_bytes()


@pytest.mark.parametrize("verb", ["run", "bring"])
def test_a_guest_runs_nothing(router: str, tmp_path: Path, verb: str) -> None:
    (tmp_path / "lab.toml").write_text(LAB)
    words = (
        ["agent", "bring", "--as", "b", "--yes"]
        if verb == "bring"
        else ["run", "lab.toml"]
    )
    known = {"REMS_ROUTER": router, "REMS_USER": "team1", "REMS_PASSWORD": TEAM}
    done = rems(tmp_path, *words, **known)
    assert done.returncode == 2
    assert done.stderr == (
        f"rems: 'team1' is a guest of the router at {router}: guests may read "
        "everything, command robots, and stop them, and no more. Set REMS_USER and "
        "REMS_PASSWORD to those of a member, or use a router of your own (unset "
        "REMS_ROUTER). (R0609)\n"
    )


def test_a_user_without_a_password(tmp_path: Path, router: str) -> None:
    done = rems(tmp_path, "list", REMS_ROUTER=router, REMS_USER="anna")
    assert done.returncode == 2
    assert done.stderr == (
        "rems: REMS_USER is set, and REMS_PASSWORD is not. Set both, for a router that "
        "was started with --users, or neither."
        " (R0606)\n"
    )
