"""rems-serve.service and Containerfile: what they run is served, and no more."""

import json
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.agents.runs import free_port
from tests.commands import ROOT, finished
from tests.interrupts import interrupt
from tests.pages import started

UNIT = ROOT / "deploy" / "rems-serve.service"
CONTAINER = ROOT / "deploy" / "Containerfile"
needs_systemd = pytest.mark.skipif(
    shutil.which("systemd-analyze") is None,
    reason="there is no systemd-analyze (package systemd)",
)


def unit(folder: Path, *, users: bool = False) -> Path:
    """The unit with the `rems` of this environment, as it is or for a list of users."""
    text = UNIT.read_text(encoding="utf-8")
    if users:
        text = re.sub("(?m)^ExecStart=.*\n", "", text, count=1)
        text = re.sub("(?m)^#(LoadCredential|ExecStart)", r"\1", text)
        assert text.count("ExecStart=") == 1
    made = folder / UNIT.name
    here = Path(sys.executable).with_name("rems")
    made.write_text(text.replace("/opt/rems_net/bin/rems", str(here)))
    return made


def analyze(*words: object) -> subprocess.CompletedProcess[str]:
    return finished(["systemd-analyze", *map(str, words)])


@needs_systemd
@pytest.mark.parametrize("users", [False, True])
def test_the_unit_is_well(tmp_path: Path, users: bool) -> None:
    done = analyze("verify", unit(tmp_path, users=users))
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


@needs_systemd
def test_the_unit_can_do_little_else(tmp_path: Path) -> None:
    """Below 2.0 is what systemd calls OK; an unprotected service has 9.6."""
    done = analyze("security", "--offline=true", "--threshold=20", unit(tmp_path))
    assert done.returncode == 0, done.stdout


def commands(path: Path) -> list[str]:
    """The `rems` lines that a file runs."""
    text = path.read_text(encoding="utf-8")
    found = re.findall(r"^#?ExecStart=/opt/rems_net/bin/(rems .*)$", text, re.M)
    for name in ("ENTRYPOINT", "CMD"):
        for words in re.findall(rf"^{name} (\[.*\])$", text, re.M):
            found.append(shlex.join(json.loads(words)))
    return found


def test_what_they_run_is_served(tmp_path: Path) -> None:
    first, with_users = commands(UNIT)
    users = tmp_path / "users.toml"
    users.write_text('[members]\nanna = "seven green herons"\n')
    users.chmod(0o600)
    with_users = with_users.replace("%t/rems_net/users.toml", users.as_posix())
    assert " ".join(commands(CONTAINER)) == "rems router serve --no-qr" == first
    for line in (first, with_users):
        port = free_port()
        with started(tmp_path, f"{line} --listen tcp/127.0.0.1:{port}") as fabric:
            assert fabric.stdout is not None
            said = iter(fabric.stdout.readline, "")
            assert any(one.startswith("Open fabric 'rems'. ") for one in said)
            interrupt(fabric)  # as both of them end it
            assert fabric.wait(20) == 0


def test_both_end_it_by_the_signal_that_it_knows() -> None:
    assert "\nKillSignal=SIGINT\n" in UNIT.read_text(encoding="utf-8")
    assert "\nSTOPSIGNAL SIGINT\n" in CONTAINER.read_text(encoding="utf-8")


def test_the_container_takes_what_the_project_has() -> None:
    text = CONTAINER.read_text(encoding="utf-8").replace("\\\n", " ")
    steps = [line.split(maxsplit=1) for line in text.splitlines() if line[:1].isupper()]
    assert steps[0][0] == "FROM"
    for name, words in steps:
        if name == "COPY":
            for source in words.split()[:-1]:
                assert (ROOT / source).exists(), source
    assert re.search(r"^EXPOSE 7447$", text, re.M)
    assert re.search(r"^USER 65534:65534$", text, re.M)  # not root
    # what it takes is enough to build from: hatchling wants these
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert 'readme = "README.md"' in project
    assert 'license-files = ["LICENSE"]' in project
