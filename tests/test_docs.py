"""What the README and the pages say is what happens: every block of them is run."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.agents.runs import until
from tests.commands import ROOT, python
from tests.interrupts import APART, interrupt
from tests.pages import blocks, rems, rows, running

README = ROOT / "README.md"
#: docs/defdict.md and docs/first_hour.md have tests of their own.
PAGES = [
    p
    for p in sorted([*ROOT.glob("docs/*.md"), *ROOT.glob("docs/measured/*.md")])
    if p.name not in ("defdict.md", "first_hour.md")
]
#: runs scripts, each with its own names
EACH = "import runpy, sys; [runpy.run_path(name) for name in sys.argv[1:]]"
ENDPOINT = "tcp/127.0.0.1:7447"


def test_the_first_two_commands() -> None:
    """What `.ci/run` takes from here, and what the pages of the project promise."""
    install, test, *_ = blocks(README, "sh")
    assert install == 'python -m pip install ".[all,test]" && rems demo\n'
    assert test == "python -m pytest -n auto\n"


def test_a_robot_of_your_own(tmp_path: Path) -> None:
    script = blocks(README, "python")[0]
    assert len([line for line in script.splitlines() if line.strip()]) <= 20
    (tmp_path / "weave.py").write_text(script)
    done = python(tmp_path, "weave.py")
    assert (done.returncode, done.stderr) == (0, "")
    found = rows(tmp_path / "runs" / "weave" / "cart.csv")
    assert len(found) == 200
    # 0.2 m/s ahead; the heading is the integral of cos t, so it comes back to sin t
    assert float(found[-1]["state/heading [rad]"]) == pytest.approx(-0.544, abs=0.05)


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    """The README's `lab.toml`, as it is there."""
    (tmp_path / "lab.toml").write_text(blocks(README, "toml")[0])
    return tmp_path


def test_an_experiment_in_a_file(lab: Path) -> None:
    assert "rems run lab.toml\n" in blocks(README, "sh")
    done = rems(lab, "rems run lab.toml")
    assert (done.returncode, done.stderr) == (0, "")
    assert len(rows(lab / "runs" / "lab" / "sim.csv")) == 100


def test_playing_a_csv_file(lab: Path) -> None:
    first, second = blocks(README, "toml")
    command = 'command = "input/keys"'
    assert f"`{command}`" in README.read_text(encoding="utf-8")
    told = first.replace("[[robot]]\n", f"[[robot]]\n{command}\n")
    (lab / "lab.toml").write_text(f"{told}\n{second}")
    (lab / "keys.csv").write_text(blocks(README, "csv")[0])
    done = rems(lab, "rems run lab.toml")
    assert (done.returncode, done.stderr) == (0, "")
    wheel = [
        row["command/wheel/left [rad/s]"] for row in rows(lab / "runs/lab/sim.csv")
    ]
    assert [float(x) for x in wheel] == pytest.approx(
        [6.8] * 20 + [-3.4] * 10 + [0.0] * 70
    )


def test_what_is_going_on(tmp_path: Path) -> None:
    """Every line that reads live state, while `rems demo --pace 0.1` runs."""
    pytest.importorskip("mujoco")
    demo, live = blocks(README, "sh")[3:]
    lines = live.splitlines()
    assert len(lines) == 5
    with running(tmp_path, demo.strip()):
        for line in lines:
            assert line.startswith("rems ")
            end = " --count 2" if line.startswith("rems watch") else ""
            done = rems(tmp_path, line + end)
            assert (done.returncode, done.stderr) == (0, ""), line
            assert "mujoco" in done.stdout


def test_without_rems_net(lab: Path) -> None:
    """The plain program: ten lines, no import of ours; it reads, and it drives."""
    program = blocks(README, "python")[1]
    assert "rems_net" not in program
    assert len([line for line in program.splitlines() if line.strip()]) <= 10
    with running(lab, "rems run lab.toml --pace 0.1") as endpoint:
        (lab / "plain.py").write_text(program.replace(ENDPOINT, endpoint))
        plain = subprocess.Popen(
            [sys.executable, "-u", "plain.py"],
            cwd=lab,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            **APART,
        )
        assert plain.stdout is not None
        try:
            moved = re.compile(r"rems/robot/sim/state \{'x': (\S+), 'y': \S+, .*\}\n")
            said = ""
            for said in plain.stdout:
                match = moved.fullmatch(said)
                assert match, said
                if float(match[1]) > 0.02:
                    break
            else:
                raise AssertionError(f"it ended: {said}")
        finally:
            interrupt(plain)  # killed, it leaves shared memory behind
            plain.communicate()
        left, file = "command/wheel/left [rad/s]", lab / "runs/lab/sim.csv"
        until(lambda: rows(file)[-1][left] == "0.0")  # told nothing, it stops
    driven = {
        (row["command/wheel/left [rad/s]"], row["command/wheel/right [rad/s]"])
        for row in rows(lab / "runs/lab/sim.csv")
    }
    assert driven == {("0.0", "0.0"), ("3.0", "2.0")}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_pages(tmp_path: Path, page: Path) -> None:
    """Each `python` block of a page is a script of its own.

    One that runs an experiment does it in this process, if it can; the slow tests of
    tests/engine/test_law.py run it in processes, too. The others follow, with names of
    their own.
    """
    others = []
    for i, block in enumerate(blocks(page, "python")):
        file = tmp_path / f"block{i}.py"
        file.write_text(block)
        if ".run(" in block or "sweep(" in block:
            # real time, and the workers of a sweep, are for processes
            live = "pace" in block or "sweep(" in block
            line = f"rems run --direct {file.name}"
            done = python(tmp_path, file.name) if live else rems(tmp_path, line)
            assert (done.returncode, done.stderr) == (0, ""), block
        else:
            others.append(file.name)
    if others:
        done = python(tmp_path, "-c", EACH, *others)
        assert (done.returncode, done.stderr) == (0, ""), others


@pytest.mark.parametrize("page", [README, *PAGES], ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", text):
        if "://" not in target:
            assert (page.parent / target).exists(), target
