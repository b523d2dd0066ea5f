"""What a hostile run may have opened, used or learnt of the laptop that brings it."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from rems_net.agents.experiment.placement.bring import REFUSED
from rems_net.agents.experiment.placement.code import check_code
from rems_net.agents.experiment.placement.models import check_models
from rems_net.agents.experiment.placement.needs import source_digest
from rems_net.agents.experiment.placement.offered import check_allowed, uses
from rems_net.agents.protocol.placement import File, Offer, read_caller, read_offer
from rems_net.errors import ExperimentError, FabricError, WireError
from rems_net.pictures import album
from rems_net.router.gate import access
from rems_net.router.gate.standing import answer_for, vouches
from rems_net.router.gate.users import Users
from rems_net.router.mail import Question
from rems_net.router.message import pack
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.protocol.fuzz import OFFER, PLAN
from tests.agents.runs import free_port
from tests.cli.conftest import KEYS
from tests.cli.placement.conftest import ON_B, Pair, ended, one_line, wait_for
from tests.commands import rems

DRIVERS = "rems_net.drivers"
KINEMATIC = f"{DRIVERS}.kinematic.kinematic:Kinematic"
SERIAL = f"{DRIVERS}.hardware.create2.open_interface:OpenInterface"
CREATE2 = "rems_net.robots.create2:Create2"
PLAY = "rems_net.inputs.csv:CsvInput"
INPUT = {k: v for k, v in PLAN.items() if k not in ("parameters", "initial")}
INPUT |= {"kind": "input", "name": "keys", "classes": [PLAY], "sources": {}}


def offered(*plans: dict[str, Any], **more: Any) -> Offer:
    """An offer of these plans, as it is read here."""
    hosts = {"robot/sim": plans}
    made = OFFER._replace(hosts=hosts, code={}, words=[])._replace(**more)
    return read_offer(made.to_wire())


def play(file: object) -> dict[str, Any]:
    return INPUT | {"options": pack({"file": file})}


ELSEWHERE = [
    *("/etc/passwd", "/dev/zero", "//host/share/x", " /etc/passwd", "~/.ssh/id_rsa"),
    *("../x.csv", "data/../../x.csv", "..", ".. /x", "..\\x.csv", "a\\..\\..\\x.csv"),
    *("C:\\x.csv", "C:x.csv", "c:/x.csv", "\\\\host\\share\\x", "\\\\?\\C:\\x.csv"),
    *("\\\\.\\PhysicalDrive0", "file:///etc/passwd", "http://host/x.csv", "x.csv:y"),
    *("nul", "CON.csv", "data/aux.csv", "com1.csv", "$HOME/x.csv", "%APPDATA%\\x"),
    *("keys\0.csv" * 9, "x" * 5000, "data/keys.csv/../../x.csv"),
]


WORLD = INPUT | {"kind": "world", "classes": ["rems_net.agents.world:World"]}
ROBOT = PLAN | {"classes": [CREATE2, KINEMATIC]}
OWN = INPUT | {"kind": "process", "classes": ["lab.py:Follow"]}
LAB = {"lab.py": "f" * 64}
PLACES: dict[str, Callable[[str], Offer]] = {
    "a CSV input": lambda name: offered(play(name)),
    "a place": lambda name: offered(WORLD | {"options": pack({"mjcf": name})}),
    "a list": lambda name: offered(
        WORLD | {"options": pack({"boxes": [{"name": name}]})}
    ),
    "one's own class": lambda name: offered(
        OWN | {"options": pack({"a": [[[{"b": name}]]]})}, code=LAB
    ),
    "a driver": lambda name: offered(ROBOT | {"options": pack({"port": name})}),
    "a definition": lambda name: offered(ROBOT | {"parameters": pack({"a": name})}),
    "a start": lambda name: offered(ROBOT | {"initial": pack({"a": {"x": name}})}),
    "a word": lambda name: offered(play("data/keys.csv"), words=["a", name]),
}


@pytest.mark.parametrize("place", PLACES)
def test_no_file_of_elsewhere(place: str) -> None:
    """In any setting, however deep, of any part; and in the words of a script."""
    for name in ELSEWHERE:
        if "\0" in name and place == "a word":
            continue  # it comes as a question mark
        try:
            said = f"asks for {[use.text for use in uses(PLACES[place](name))]}"
        except (ExperimentError, WireError) as error:
            said = str(error)
        good = ("none of the files", "; expected ", "asks for ['http://host/x.csv']")
        assert any(words in said for words in good), (name, said)


def test_what_comes_with_the_run_is_read() -> None:
    names = [
        "data/keys.csv",
        "gain.txt",
        "Run: 3",
        "rk4",
        "m/s",
        "",
        "a ... b",
        "crate.1",
    ]
    for name in names:
        assert uses(offered(play(name), words=[name])) == []


def test_settings_that_are_no_message() -> None:
    for settings in (b"\xc1", b"\x91" * 100_000, b"\x81\xa1a\xc0\xc0"):
        with pytest.raises(WireError, match="no message"):
            uses(offered(INPUT | {"options": settings}))


ADDRESSES = [
    *("/dev/ttyUSB0", "/dev/cu.usbserial-1", "COM3", "\\\\.\\COM12", "/dev/pts/3"),
    *("ws://192.168.8.200", "tcp://10.0.0.1:1234", "192.168.8.200", "robot.local"),
    *("robot:80", "fe80::1", "[fe80::1]:80"),
]


@pytest.mark.parametrize("address", ADDRESSES)
def test_a_port_or_an_address_is_asked_for(address: str) -> None:
    robot = PLAN | {"classes": [CREATE2, SERIAL], "options": pack({"port": address})}
    used = uses(offered(robot))
    assert used == [("robot/sim", address)]
    with pytest.raises(ExperimentError, match="with --yes such is named, too: --allow"):
        check_allowed(used, [])
    check_allowed(used, [address])


@pytest.mark.parametrize("file", ["/dev/zero", "/dev/sda", "/dev/mem", "/dev/tty/../x"])
def test_what_is_no_port_is_not_asked_for(file: str) -> None:
    robot = PLAN | {"classes": [CREATE2, SERIAL], "options": pack({"port": file})}
    with pytest.raises(ExperimentError, match="nothing else of this laptop"):
        uses(offered(robot))


def test_a_driver_of_ones_own_is_told_no_host_unasked() -> None:
    robot = PLAN | {"classes": [CREATE2, "lab.py:Mine"], "options": pack({"at": "box"})}
    assert uses(offered(robot, code={"lab.py": "f" * 64})) == [("robot/sim", "box")]


def test_what_is_asked_for_can_be_read() -> None:
    """No escape sequence, and nothing so long that its end is not seen."""
    robot = PLAN | {"classes": [CREATE2, "lab.py:Mine"]}
    for text in ("ws://a\x1b[2Jb", "box\x1b[2J", "ws://" + "a" * 300, "b" * 300):
        with pytest.raises(ExperimentError, match="nothing else of this laptop"):
            uses(offered(robot | {"options": pack({"at": text})}, code=LAB))


def test_a_camera_of_any_name_is_kept_in_the_folder_of_the_run() -> None:
    assert album("bot", "sensors", "a\\..\\..\\x:y") == "bot.a_.._.._x_y"


# -- files inside files --------------------------------------------------------------

MODELS = {
    "up": {"a/room.xml": b'<mujoco><mesh file="../../x.stl"/></mujoco>'},
    "up by a folder": {
        "room.xml": b'<mujoco><compiler meshdir=".."/><mesh file="x.stl"/></mujoco>'
    },
    "absolute": {"room.xml": b'<mujoco><hfield file="/etc/passwd"/></mujoco>'},
    "an absolute folder": {
        "room.xml": b'<mujoco><compiler assetdir="/etc"/><mesh file="x"/></mujoco>'
    },
    "of Windows": {"room.xml": b'<mujoco><texture fileup="C:\\x.png"/></mujoco>'},
    "included deeper": {
        "room.xml": b'<mujoco><include file="a/b/in.xml"/></mujoco>',
        "a/b/in.xml": b'<mujoco><mesh file="../../x.stl"/></mujoco>',
    },
    "URDF": {"arm.urdf": b'<robot><mesh filename="file:///etc/x.stl"/></robot>'},
    "a package": {"arm.urdf": b'<robot><mesh filename="package://etc/x.stl"/></robot>'},
    "an entity": {"a.xml": b'<!DOCTYPE a [<!ENTITY x "/etc">]><a file="&x;/passwd"/>'},
    "no XML": {"a.xml": b"<a"},
    "an unknown encoding": {"a.xml": b'<?xml version="1.0" encoding="x"?><a/>'},
    "OBJ": {"x.obj": b"v 0 0 0\nmtllib ../../x.mtl\n"},
}


@pytest.mark.parametrize("name", MODELS)
def test_no_model_names_a_file_of_elsewhere(name: str) -> None:
    with pytest.raises(ExperimentError, match=r"is not below|declares|is no XML"):
        check_models(MODELS[name])


def test_models_that_name_what_is_beside_them() -> None:
    check_models(
        {
            "a/room.xml": b'<mujoco><compiler meshdir="../m"/><mesh file="x.stl"/>'
            b'<light dir="0 0 -1"/></mujoco>',
            "arm/urdf/arm.urdf": b'<robot><mesh filename="../m/x.obj"/>'
            b'<mesh filename="package://arm/m/x.obj"/></robot>',
            "arm/m/x.obj": b"mtllib x.mtl\nv 0 0 0\n",
        }
    )


# -- classes of the user's own -------------------------------------------------------

SOURCES = {
    "from rems_net import Process\nclass Mine(Process): pass": True,
    "import rems_net as r\nclass Mine(r.Process): pass": True,
    "from rems_net import Process\nclass A(Process): pass\nclass Mine(A): pass": True,
    "from other import Base\nclass Mine(Base): pass": True,
    "from other import Base as Mine": True,
    "class Mine: pass": False,
    "Mine = print": False,
    "from subprocess import Popen\nclass Mine(Popen): pass": False,
    "from subprocess import Popen as Mine": False,
    "class Mine(Mine): pass": False,
    "class A(Mine): pass\nclass Mine(A): pass": False,
    "class Process: pass\nclass Mine(Process): pass": False,
    "class Mine(": False,
}


@pytest.mark.parametrize("source", SOURCES)
def test_a_class_is_looked_at_before_it_is_imported(
    source: str, tmp_path: Path
) -> None:
    other = "from rems_net import Process\nclass Base(Process): pass\n"
    trap = f"import pathlib\npathlib.Path({str(tmp_path / 'run')!r}).touch()\n"
    code = {}
    for name, text in (("mine.py", trap + source), ("other.py", other)):
        (tmp_path / name).write_text(text)
        code[name] = source_digest(text.encode())
    plan = INPUT | {"kind": "process", "classes": ["mine.py:Mine"]}
    offer = offered(plan, code=code)
    if SOURCES[source]:
        check_code(offer, tmp_path)
    else:
        with pytest.raises(ExperimentError, match="has no class Mine that can be"):
            check_code(offer, tmp_path)
    assert not (tmp_path / "run").exists()


# -- whole laptops -------------------------------------------------------------------

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
        plan = play(str(secret) if len(troubles) % 3 else "../secret.txt")
        payload = OFFER._replace(
            hosts={"input/keys": [plan]}, code={}, words=[], files={}
        ).to_wire()
        question.answer("rems/machine/b/@start", payload)

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
    wait_for(run, "rems bring")
    asked = [ben.bring("--as", "b", typed=typed) for typed in ("yes, but\n", "\x04")]
    held = ben.bring("--as", "b", typed="")
    blind = ben.start("bring", "--as", "b", "--yes")
    for one in asked:
        status, out, error = ended(one)
        assert status == 2
        assert error == "rems: nothing is started: the answer was not y.\n"
        assert "  robot/model  Woodbot done by Kinematic\n" in out
    status, _, error = ended(blind)
    assert status == 2
    assert "is open to others, so nobody knows whose run this is" in error
    wait_for(held, "Anybody at this router")
    held.send_signal(signal.SIGINT)
    status, _, error = ended(held)
    assert (status, error) == (130, "")
    run.send_signal(signal.SIGINT)
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
    port = {"classes": [CREATE2, SERIAL], "options": pack({"port": "/dev/ttyS0"})}
    offers = [
        OFFER._replace(hosts=hosts, code={}, words=[], files=files).to_wire()
        for hosts in ({"robot/sim": [PLAN | port]}, {"input/keys": [play("keys.csv")]})
    ]
    troubles: list[str] = []

    def start(question: Question) -> None:
        troubles.append(read_caller(question.payload).trouble)
        question.answer("team1/machine/b/@start", offers[len(troubles) > 2])

    known = {"REMS_USER": ben.user, "REMS_PASSWORD": ben.password}
    words = ("bring", "--as", "b", "--yes", "--fabric", "team1")
    with Session(ben) as session:
        where = f"team1/machine/b/@file/{files['keys.csv'].digest}"
        session.answer_at_once("team1/machine/b/@start", start)
        session.answer_at_once(where, lambda question: question.answer(where, data))
        session.present("team1/machine/b/@start")
        for status, sentence in (
            (2, "with --yes such is named, too: --allow /dev/ttyS0\n"),
            (1, "but the columns are 'its first line'.\n"),
        ):
            done = rems(tmp_path, *words, REMS_ROUTER=ben.endpoint, **known)
            assert done.returncode == status
            assert done.stderr.endswith(sentence)
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
        "rems: process/count: failed on the machine that brought it, whose screen says "
        "why"
    )
    assert "what is in" not in out
