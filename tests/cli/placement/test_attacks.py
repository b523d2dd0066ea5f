"""What a hostile run may have opened, used or learnt of the laptop that brings it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rems_net.agents.experiment.placement.models import check_models
from rems_net.agents.experiment.placement.needs import source_digest
from rems_net.agents.experiment.placement.offered import check_allowed, uses
from rems_net.agents.experiment.placement.sources import check_code
from rems_net.agents.protocol.placement import Offer, read_offer
from rems_net.errors import ExperimentError, WireError
from rems_net.pictures import album
from tests.agents.protocol.fuzz import OFFER, PLAN

DRIVERS = "rems_net.drivers"
KINEMATIC = f"{DRIVERS}.kinematic.kinematic:Kinematic"
SERIAL = f"{DRIVERS}.hardware.create2.open_interface:OpenInterface"
CREATE2 = "rems_net.robots.create2:Create2"
PLAY = "rems_net.inputs.csv:CsvInput"
LAB = {"lab.py": "f" * 64}


def offered(kind: str, plan: dict[str, Any], **more: Any) -> Offer:
    """An offer of one agent, as it is read here."""
    made = OFFER._replace(agents={kind: [plan]}, taken={}, code={}, words=[])
    return read_offer(made._replace(**more).to_wire())


def play(file: object, **more: Any) -> Offer:
    plan = {"name": "keys", "type": PLAY, "options": {"file": file}}
    return offered("input", plan, **more)


def world(**options: Any) -> Offer:
    return offered("world", {"name": "w", "options": options})


def robot(driver: str = KINEMATIC, **more: Any) -> Offer:
    code = LAB if driver.startswith("lab.py") else {}
    plan = PLAN | {"definition": CREATE2, "driver": driver} | more
    return offered("robot", plan, code=code)


ELSEWHERE = [
    *("/etc/passwd", "/dev/zero", "//host/share/x", " /etc/passwd", "~/.ssh/id_rsa"),
    *("../x.csv", "data/../../x.csv", "..", ".. /x", "..\\x.csv", "a\\..\\..\\x.csv"),
    *("C:\\x.csv", "C:x.csv", "c:/x.csv", "\\\\host\\share\\x", "\\\\?\\C:\\x.csv"),
    *("\\\\.\\PhysicalDrive0", "file:///etc/passwd", "http://host/x.csv", "x.csv:y"),
    *("nul", "CON.csv", "data/aux.csv", "com1.csv", "$HOME/x.csv", "%APPDATA%\\x"),
    *("keys\0.csv" * 9, "x" * 5000, "data/keys.csv/../../x.csv"),
]


OWN = {"name": "own", "type": "lab.py:Follow"}
PLACES: dict[str, Callable[[str], Offer]] = {
    "a CSV input": play,
    "a place": lambda name: world(mjcf=name),
    "a list": lambda name: world(boxes=[{"name": name}]),
    "a word beside a name": lambda name: offered("world", {"name": "w", "mjcf": name}),
    "one's own class": lambda name: offered(
        "process", OWN | {"options": {"a": [[[{"b": name}]]]}}, code=LAB
    ),
    "a driver": lambda name: robot(options={"port": name}),
    "a definition": lambda name: robot(parameters={"a": name}),
    "a start": lambda name: robot(initial={"a": {"x": name}}),
    "a word": lambda name: play("data/keys.csv", words=["a", name]),
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
        assert uses(play(name, words=[name])) == []


def test_settings_that_a_robot_does_not_have() -> None:
    told: list[dict[str, Any]]
    told = [{"file": "/etc/passwd"}, {"options": "x"}, {"sources": {}}]
    for more in told:
        with pytest.raises(WireError, match="; expected "):
            robot(**more)


ADDRESSES = [
    *("/dev/ttyUSB0", "/dev/cu.usbserial-1", "COM3", "\\\\.\\COM12", "/dev/pts/3"),
    *("ws://192.168.8.200", "tcp://10.0.0.1:1234", "192.168.8.200", "robot.local"),
    *("robot:80", "fe80::1", "[fe80::1]:80"),
]


@pytest.mark.parametrize("address", ADDRESSES)
def test_a_port_or_an_address_is_asked_for(address: str) -> None:
    used = uses(robot(SERIAL, options={"port": address}))
    assert used == [("robot/sim", address)]
    with pytest.raises(ExperimentError, match="with --yes such is named, too: --allow"):
        check_allowed(used, [])
    check_allowed(used, [address])


@pytest.mark.parametrize("file", ["/dev/zero", "/dev/sda", "/dev/mem", "/dev/tty/../x"])
def test_what_is_no_port_is_not_asked_for(file: str) -> None:
    with pytest.raises(ExperimentError, match="nothing else of this laptop"):
        uses(robot(SERIAL, options={"port": file}))


def test_a_driver_of_ones_own_is_told_no_host_unasked() -> None:
    used = uses(robot("lab.py:Mine", options={"at": "box"}))
    assert used == [("robot/sim", "box")]


def test_what_is_asked_for_can_be_read() -> None:
    """No escape sequence, and nothing so long that its end is not seen."""
    for text in ("ws://a\x1b[2Jb", "box\x1b[2J", "ws://" + "a" * 300, "b" * 300):
        with pytest.raises(ExperimentError, match="nothing else of this laptop"):
            uses(robot("lab.py:Mine", options={"at": text}))


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
    offer = offered("process", {"name": "own", "type": "mine.py:Mine"}, code=code)
    if SOURCES[source]:
        check_code(offer, tmp_path)
    else:
        with pytest.raises(ExperimentError, match="has no class Mine that can be"):
            check_code(offer, tmp_path)
    assert not (tmp_path / "run").exists()
