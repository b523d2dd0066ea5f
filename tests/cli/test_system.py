"""What a system can do to the `rems` command: a sentence, never a traceback."""

import os
import shlex
import shutil
import sys
from pathlib import Path

import pytest

from tests.agents.runs import until
from tests.cli.conftest import FREE, LAB, together
from tests.commands import (
    Done,
    Run,
    Start,
    begun,
    command,
    environment,
    finished,
    reason_of,
)
from tests.signals import freeze, thaw

#: the command as it was installed; the module, where it is not on the path
INSTALLED = shutil.which("rems", path=str(Path(sys.executable).parent))
REMS = [INSTALLED] if INSTALLED else [sys.executable, "-m", "rems_net"]
SPARE = "the temporary folder of a test can hold no such name here"

shell = pytest.mark.skipif(os.name != "posix", reason="there is no `sh` here")


def sh(line: str, folder: Path, **more: str) -> Done:
    """Type a line, in which `rems` is the command, at a shell."""
    line = line.replace("rems ", f"{shlex.join(REMS)} ")
    return finished(
        ["sh", "-c", line], folder, environment(PYTHONWARNINGS="error", **more)
    )


def rows(folder: Path) -> int:
    return len((folder / "runs" / "lab" / "model.csv").read_text().splitlines()) - 1


# -- XDG_RUNTIME_DIR -----------------------------------------------------------------


@pytest.mark.parametrize("verb", ["run lab.toml", "list", "stop"])
@pytest.mark.parametrize(
    ("where", "reason"),
    [("lab.toml", "File exists"), ("lab.toml/run", "Not a directory")],
)
def test_a_runtime_folder_that_is_none(
    folder: Path, rems: Run, verb: str, where: str, reason: str
) -> None:
    if os.name == "nt":  # it has its own words for both
        reason = reason_of((folder / where).mkdir)
    told = str(folder / where)
    done = rems(*verb.split(), XDG_RUNTIME_DIR=told)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        f"rems: XDG_RUNTIME_DIR is {told!r}, and no folder for the notes of routers "
        f"can be made there: {reason}. Set XDG_RUNTIME_DIR to a folder of your own, "
        "or unset it. (R0612)\n"
    )


def test_a_runtime_folder_that_cannot_be_made(rems: Run) -> None:
    if not Path("/proc/self").exists():
        pytest.skip("a folder in which root can make nothing (/proc) is missing")
    done = rems("list", XDG_RUNTIME_DIR="/proc/rems/run")
    assert done.returncode == 2
    assert done.stderr.startswith("rems: XDG_RUNTIME_DIR is '/proc/rems/run', and no ")
    assert done.stderr.count("\n") == 1


@shell
def test_a_runtime_folder_that_is_missing_is_made(folder: Path, rems: Run) -> None:
    (folder / "lab.toml").write_text(together(LAB))
    done = rems("run", "lab.toml", XDG_RUNTIME_DIR=str(folder / "new" / "run"))
    assert (done.returncode, done.stderr) == (0, "")
    assert (folder / "new" / "run").stat().st_mode & 0o777 == 0o700


# -- open files ----------------------------------------------------------------------


@shell
@pytest.mark.parametrize("limit", [8, 15, 23])
def test_few_open_files(folder: Path, limit: int) -> None:
    done = sh(f"ulimit -n {limit}; exec rems run lab.toml", folder)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(
        "rems: This needs 21 more open files, and the system gives this program "
    )
    assert done.stderr.endswith(
        ". Type `ulimit -n 1024` first, in this terminal. (R0614)\n"
    )
    assert done.stderr.count("\n") == 1


@shell
def test_just_enough_open_files(folder: Path) -> None:
    """What is asked for is what is needed: with it, the run goes to its end."""
    for limit in range(24, 40):
        done = sh(f"ulimit -n {limit}; exec rems run lab.toml", folder)
        if done.returncode == 0:
            assert done.stderr == ""
            assert rows(folder) == 10
            return
        assert "This needs 21 more open files" in done.stderr
    raise AssertionError(done.stderr)


# -- the working folder --------------------------------------------------------------

GONE = "The folder in which you are was removed. Go to another one: cd ~"


@shell
@pytest.mark.parametrize(
    ("verb", "sentence"),
    [
        ("run HERE/lab.toml", GONE),
        ("demo", GONE),
    ],
)
def test_a_folder_that_was_removed(folder: Path, verb: str, sentence: str) -> None:
    verb = verb.replace("HERE", str(folder))
    done = sh(f"mkdir gone; cd gone; rmdir ../gone; rems {verb}", folder)
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1] == f"rems: {sentence}"
    assert "Traceback" not in done.stderr


@pytest.mark.skipif(os.name == "nt", reason="there a folder that is used stays")
@pytest.mark.parametrize(
    ("verb", "sentence"),
    [
        ("run lab.toml", f"There is no file lab.toml. {GONE} (R0401)"),
        (
            "compare runs/lab",
            f"There is no folder {Path('runs/lab')}; expected the folder of a run, "
            f"such as runs/demo. {GONE} (R0840)",
        ),
    ],
)
def test_a_folder_that_was_removed_in_this_process(
    rems: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, verb: str, sentence: str
) -> None:
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    done = rems(*verb.split())
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1] == f"rems: {sentence}"


@shell
def test_who_needs_no_folder_does_without(folder: Path) -> None:
    (folder / "lab.toml").write_text(together(LAB))
    line = f"rems run {folder}/lab.toml --out {folder}/out"
    done = sh(f"mkdir gone; cd gone; rmdir ../gone; {line}", folder)
    assert (done.returncode, done.stderr) == (0, "")
    assert (folder / "out" / "model.csv").exists()


# -- standard streams ----------------------------------------------------------------


@shell
@pytest.mark.parametrize(
    ("closed", "how"), [("<&-", "--direct"), (">&-", "--direct"), ("<&- >&- 2>&-", "")]
)
def test_closed_streams_are_as_dev_null(folder: Path, closed: str, how: str) -> None:
    """What is written by this process, and by those that it starts."""
    done = sh(f"rems run lab.toml {how} {closed}", folder)
    assert (done.returncode, done.stderr) == (0, "")
    assert (done.stdout == "") == (">&-" in closed)
    assert rows(folder) == 10
    text = (folder / "runs" / "lab" / "model.csv").read_text()
    assert text.startswith("time [s],")


@shell
def test_a_complaint_with_a_closed_output(folder: Path) -> None:
    done = sh("rems list >&-", folder)
    assert done.returncode == 2
    assert done.stderr.startswith("rems: No fabric 'rems' is running on this machine.")
    assert done.stderr.count("\n") == 1
    done = sh("rems lst <&- >&- 2>&-", folder)
    assert (done.returncode, done.stdout, done.stderr) == (2, "", "")


@shell
def test_a_full_disk_under_the_output(folder: Path, rems: Run) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("a device that is always full (/dev/full) is missing")
    assert rems("run", "--direct", "lab.toml").returncode == 0
    done = sh("rems compare runs/lab >/dev/full", folder)
    assert (done.returncode, done.stderr) == (
        1,
        "rems: The system refuses: No space left on device. (R0905)\n",
    )


# -- names that are no UTF-8 ---------------------------------------------------------


def no_utf8(folder: Path) -> Path:
    """A folder `caf\\xe9`, as a Latin-1 system left it."""
    odd = Path(os.fsdecode(os.fsencode(folder) + b"/caf\xe9"))
    try:
        odd.mkdir()
    except (OSError, UnicodeError):
        pytest.skip(SPARE)
    for name in ("lab.toml", "keys.csv"):
        shutil.copy(folder / name, odd)
    return odd


@shell
def test_a_folder_that_is_no_utf8(
    folder: Path, rems: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "lab.toml").write_text(together(LAB))
    odd = no_utf8(folder)
    name = ascii(str(odd))
    why = "is no UTF-8, in which agents get their paths; rename it, or go to another"
    monkeypatch.chdir(odd)
    done = rems("run", "lab.toml")
    assert done.returncode == 2
    assert done.stderr == (
        f"rems: lab.toml, [experiment]: the name of the folder {name} {why} one. "
        "(R0414)\n"
    )
    done = rems("run", f"{folder}/lab.toml", "--out", ".")
    assert done.returncode == 2
    assert (
        f"lab.toml: the name of the folder {name} {why} one. (R0414)\n" in done.stderr
    )
    # Outside of both it does no harm.
    done = sh(f"rems run {folder}/lab.toml --out {folder}/out", odd)
    assert (done.returncode, done.stderr) == (0, "")
    assert "model.csv" in rems("compare", f"{folder}/out").stdout


@shell
def test_a_file_that_is_no_utf8(
    folder: Path, rems: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    odd = no_utf8(folder)
    (odd / "model.csv").write_text("time [s],x [m]\n0.1,0.0\n")
    monkeypatch.chdir(odd)
    assert "Traceback" not in rems("compare", ".").stderr
    done = sh("rems run $(printf 'caf\\351').toml", folder)
    assert (done.returncode, done.stderr) == (
        2,
        f"rems: There is no file caf\\udce9.toml in {folder}. Did you mean "
        "'lab.toml'?"
        " (R0401)\n",
    )


def test_a_reader_that_has_gone(folder: Path) -> None:
    process = begun(command("completion", "bash"), folder)
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.close()
    with process.stderr:
        assert process.stderr.read() == ""
    assert process.wait(20) == 0


@shell
def test_a_machine_whose_name_is_no_utf8(folder: Path) -> None:
    """In a namespace of its own, so that this machine keeps its name."""
    (folder / "lab.toml").write_text(together(LAB))
    unshare = shutil.which("unshare")
    name = "import socket, sys; socket.sethostname(b'caf\\xe9'); "
    then = f"import os; os.execv({REMS[0]!r}, {[*REMS, 'run', 'lab.toml']!r})"
    if not unshare or os.getuid() != 0:
        pytest.skip("only root can name a machine, in a namespace made by `unshare`")
    done = finished([unshare, "--uts", sys.executable, "-c", name + then], folder)
    if "unshare failed" in done.stderr:
        pytest.skip(f"no namespaces here: {done.stderr.strip()}")
    assert (done.returncode, done.stderr) == (0, "")
    assert rows(folder) == 10


def test_a_run_that_is_frozen_is_not_taken_for_none(
    folder: Path, rems: Run, start: Start
) -> None:
    """Its router is frozen with it: what listens there is named, its note stays."""
    (folder / "free.toml").write_text(FREE)
    running = start("run", "free.toml")
    notes = Path(os.environ["XDG_RUNTIME_DIR"]) / "rems_net"
    until(lambda: list(notes.glob("*.json")) and rems("list").returncode == 0)
    freeze(running.pid)
    try:
        done = rems("stop")
    finally:
        thaw(running.pid)
    assert done.returncode == 2
    assert (
        "and does not answer: is it frozen, by a debugger or by sleep?" in done.stderr
    )
    assert list(notes.glob("*.json"))
