"""Errors have codes, and each code has a text whose examples run.

`python -m tests.errors --write` renews the golden file. It is read as a whole: each
sentence has to be understood without another one.
"""

import shlex
import shutil
from collections.abc import Iterator
from contextlib import chdir
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from rems_net.agents.experiment.file import load as load_file
from rems_net.bodies import Body, Model
from rems_net.bodies.files.built import built
from rems_net.bodies.tree import Tree
from rems_net.cli import main
from rems_net.cli.demo import FILE
from rems_net.errors import RemsError, uncoded
from rems_net.explain import Block, Entry, entries
from tests import errors
from tests.agents.runs import free_port, ticking
from tests.cli.conftest import place, starting

ENTRIES = entries()
#: begins an experiment, for examples of its other tables
SECOND = '[experiment]\nduration = "1 s"\n\n'
#: entries whose examples need a fabric -> its fixture
AT_FABRICS = dict.fromkeys(
    ("R0602", "R0603", "R0606", "R0615", "R0617", "R0618", "R0619", "R0620"),
    "fabric",
) | {"R0609": "school"}
#: those come last, so that their fabrics do not run beside all others
EXAMPLES = [
    pytest.param(entry.code, block, id=f"{entry.code}-{i}")
    for entry in sorted(ENTRIES.values(), key=lambda one: one.code in AT_FABRICS)
    for i, block in enumerate(entry.blocks)
]
#: what examples begin with, to have a recording; it is run once for all of them
DEMO = "rems demo"
#: what tests.errors reads
Source = tuple[list[tuple[str, int, str]], dict[str, list[str]]]


@pytest.fixture(scope="module")
def fabric(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """An open fabric with robot/sim; the variables with which programs find it."""
    folder = tmp_path_factory.mktemp("fabric")
    at = f"tcp/127.0.0.1:{free_port()}"
    with starting(folder) as start, place(folder):
        serve = start("router", "serve", "--listen", at)
        assert serve.stdout is not None
        serve.stdout.readline()
        start("agent", "start", "robot", "woodbot", "kinematic", "--name", "sim")
        ticking()
        yield {"REMS_ROUTER": at}


@pytest.fixture(scope="module")
def school(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """A class; the variables with which a student finds it."""
    folder = tmp_path_factory.mktemp("school")
    (folder / "names.csv").write_text("name,team,password\nAnna,team1,blue birds fly\n")
    (folder / "names.csv").chmod(0o600)
    at = f"tcp/127.0.0.1:{free_port()}"
    with starting(folder) as start, place(folder):
        serve = start("router", "serve", "--class", "names.csv", "--listen", at)
        assert serve.stdout is not None
        assert "Open fabric 'rems'" in "".join(serve.stdout.readline() for _ in "1234")
        yield {
            "REMS_ROUTER": at,
            "REMS_USER": "anna",
            "REMS_PASSWORD": "blue birds fly",
        }


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the recording of `rems demo`, of the robots that examples read.

    It is made in this process; tests/cli/test_demo.py runs the command itself.
    """
    folder = tmp_path_factory.mktemp("demo")
    experiment = load_file(FILE)
    del experiment.plans["robot/pybullet"]
    if not find_spec("mujoco"):
        del experiment.plans["robot/mujoco"]
    with place(folder), chdir(folder):
        experiment.run(direct=True)
    return folder


@pytest.fixture(scope="module")
def source() -> Source:
    """The raises without a code, and the templates of the messages."""
    return errors.read()


def test_every_error_has_a_code(source: Source) -> None:
    assert not errors.uncoded(source[0])


def test_the_list_of_errors_with_a_code_from_elsewhere_is_short(source: Source) -> None:
    """Each function in it still raises an error without a code of its own."""
    bare = {f"{file}:{function}" for file, _, function in source[0]}
    assert not errors.ELSEWHERE.keys() - bare


def test_every_code_has_an_entry_and_every_entry_a_message(source: Source) -> None:
    assert source[1].keys() == ENTRIES.keys()


def test_the_messages_are_those_of_the_golden_file(source: Source) -> None:
    """Renew it with `python -m tests.errors --write`, and read what has changed."""
    assert errors.golden(source[1]) == errors.GOLDEN.read_text(encoding="utf-8")


@pytest.mark.parametrize("entry", ENTRIES.values(), ids=ENTRIES)
def test_an_entry_has_a_paragraph_and_two_examples(entry: Entry) -> None:
    assert len(entry.text.split()) >= 20
    assert [block.right for block in entry.blocks] == [False, True]


@pytest.mark.parametrize(("code", "block"), EXAMPLES)
def test_the_examples_are_as_wrong_and_as_right_as_they_claim(
    code: str,
    block: Block,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    request: pytest.FixtureRequest,
) -> None:
    if code in AT_FABRICS:
        for name, value in request.getfixturevalue(AT_FABRICS[code]).items():
            monkeypatch.setenv(name, value)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("WEBOTS_HOME", "none")  # an example may set it otherwise
    monkeypatch.syspath_prepend(str(tmp_path))
    Path("arm.urdf").write_text(ENTRIES["R0205"].blocks[1].text, encoding="utf-8")
    Path("room.xml").write_text("<mujoco><worldbody/></mujoco>", encoding="utf-8")
    if DEMO in block.text.splitlines():
        shutil.copytree(request.getfixturevalue("demo"), tmp_path, dirs_exist_ok=True)
        capsys.readouterr()
    message = ""
    try:
        statuses = [*run(block)]
    except RemsError as error:
        message, statuses = str(error), [2]
    failed = capsys.readouterr().err if statuses[-1] else ""
    found = errors.CODE.findall(message + failed)
    assert (statuses[-1] == 0) == block.right, (statuses, message, failed)
    assert found == ([] if block.right else [code[1:]]), message + failed


def run(block: Block) -> list[int]:
    """Run an example; return the exit statuses of its commands."""
    if "emulated(" in block.text:
        pytest.importorskip("pty", reason="there are no pseudo-terminals here")
    if "import resource" in block.text:
        pytest.importorskip("resource", reason="Windows has no limits of a process")
    if "ujoco" in block.text:
        pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    if block.language == "python":
        names: dict[str, Any] = {"__name__": "example"}
        try:
            exec(compile(block.text, "example.py", "exec"), names)
        except SystemExit as end:
            return [int(end.code or 0)]
        if "body" in names:  # as body() of a definition may return it
            load(names["body"])
        return [0]
    if block.language == "xml":
        suffix = ".xml" if "<mujoco" in block.text else ".urdf"
        Path(f"robot{suffix}").write_text(block.text, encoding="utf-8")
        load(Model(f"robot{suffix}", fixed=True))
        return [0]
    if block.language == "toml":
        head = "" if "[experiment]" in block.text else SECOND
        Path("lab.toml").write_text(head + block.text, encoding="utf-8")
        return [main(["check", "lab.toml"])]
    assert block.language == "sh"
    lines = [line for line in block.text.splitlines() if line != DEMO]
    return [status(shlex.split(line)) for line in lines]


def load(body: Body | Model) -> None:
    """Read the body of a robot, as a simulation does before it starts."""
    if isinstance(body, Model):
        built(body)
    else:
        Tree(body).closed({})


def status(words: list[str]) -> int:
    """Return the exit status of a command, run in this process."""
    assert words.pop(0) == "rems"
    try:
        return main(words)
    except SystemExit as end:
        return int(end.code or 0)


@pytest.mark.parametrize(
    "typed", ["R0103", "r103", "103", "rems: 'x' is not a unit. (R0103)"]
)
def test_explain_understands(capsys: pytest.CaptureFixture[str], typed: str) -> None:
    assert main(["explain", *typed.split()]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "R0103: An unknown unit"
    assert max(map(len, lines)) <= 80
    assert {"Wrong:", "Right:"} <= {*lines}


def test_explain_lists_all_codes(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    for code in ENTRIES:
        assert [line for line in lines if line.startswith(f"  {code}  ")]


@pytest.mark.parametrize(
    ("typed", "came"),
    [
        ("R0199x", "'R0199x' has no code;"),
        ("R0140", "there is no code R0140; the nearest one is R01"),
    ],
)
def test_what_is_no_code(
    capsys: pytest.CaptureFixture[str], typed: str, came: str
) -> None:
    assert main(["explain", typed]) == 2
    assert came in capsys.readouterr().err


def test_a_longer_sentence_leaves_out_the_code() -> None:
    assert uncoded(RemsError("it is wrong. (R0101)")) == "it is wrong."
    assert uncoded("it is (R0101) wrong") == "it is (R0101) wrong"
