"""One law: an engine, one host and many hosts give the same bytes."""

import re
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from hypothesis import Phase, given, settings, strategies as st

from rems_net import Experiment
from rems_net.agents.clock.clock import Clock
from rems_net.agents.experiment.show import Show
from rems_net.agents.protocol.plan import HERE
from rems_net.cli.demo import FILE as DEMO
from rems_net.client import Fabric
from rems_net.maths.numerics import environment
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import Told, until
from tests.commands import ROOT, environment as terminal, finished
from tests.pages import blocks

PARTS = Path(__file__).parent
PYTHON = (sys.executable, "-W", "error")
EXAMPLES = ROOT / "examples"
#: Examples that drive devices, or need a robot of an open fabric.
APART = ("as_in_the_paper.py", "real_woodbot.py", "open.toml")
#: Pages whose experiments need more than the page: an installed package, a notebook.
MORE = ("parts.md", "engine.md")
KEYS = "time [s],command/wheel/left [rad/s],command/wheel/right [rad/s]\n1.0,4.0,4.0\n"
CARTS = ("a", "b", "c")
INPUTS = ("wave", "slow", "stick")


@st.composite
def experiments(draw: st.DrawFn) -> dict[str, Any]:
    """What an experiment is made of, as plain data."""
    carts = CARTS[: draw(st.integers(1, 3))]
    sources = [f"input/{name}" for name in INPUTS] + ["process/middle"]
    if len(carts) > 1:
        sources.append("process/follow")
    rate, since = st.integers(1, 4), st.sampled_from([0.0, 0.2, 0.5])
    return {
        "seed": draw(st.integers(0, 9)),
        "dt": draw(st.sampled_from([0.05, 0.1])),
        "glob": draw(st.sampled_from(["robot/*/state", "robot/a*/state"])),
        "pause": draw(st.sampled_from([0.0, 3.0])),
        "every": {name: draw(rate) for name in (*INPUTS, *carts, "follow", "middle")},
        "since": {name: draw(since) for name in (*INPUTS, *carts, "follow", "middle")},
        "commands": {name: draw(st.sampled_from(sources)) for name in carts},
        "substeps": draw(st.integers(1, 2)),
        "driver": draw(st.sampled_from(["kinematic", "parts.py:Jumper"])),
    }


#: by name of a way, the host of its agents; of `here` without outputs
HOSTS = {"one": "all", "here": "here"}


def lab(made: dict[str, Any], host: str | None) -> Experiment:
    """Return this experiment; host: one process for all agents, or each its own."""
    carts = list(made["commands"])
    more: dict[str, Any] = {"host": host} if host else {}
    new = Experiment(
        "law", dt=made["dt"], duration=2.0, seed=made["seed"], folder=PARTS
    )

    def rates(name: str) -> dict[str, Any]:
        return {"every": made["every"][name], "since": made["since"][name], **more}

    new.input(
        "wave", "parts.py:Wave", options={"pause": made["pause"]}, **rates("wave")
    )
    new.input("slow", "parts.py:Slow", **rates("slow"))
    new.input("stick", "parts.py:Stick", **rates("stick"))
    for name, command in made["commands"].items():
        new.robot(
            name,
            "parts.py:Cart",
            made["driver"],
            command=command,
            options={"substeps": made["substeps"]},
            **rates(name),
        )
    new.process("middle", "parts.py:Middle", carts=made["glob"], **rates("middle"))
    if len(carts) > 1:
        new.process(
            "follow",
            "parts.py:Follow",
            one=f"robot/{carts[0]}/state",
            other=f"robot/{carts[1]}/state",
            **rates("follow"),
        )
    new.output("log", "csv", **more if host != "here" else {})
    return new


def holds(made: dict[str, Any]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        found = {}
        for way in ("engine", "one", "here", "many"):
            out = Path(folder, way)
            new = lab(made, HOSTS.get(way))
            new.run(out, direct=way == "engine", show=Show())
            found[way] = {p.name: p.read_bytes() for p in sorted(out.glob("*.csv"))}
        assert len(found["engine"]) == len(made["commands"])
        assert all(one == found["engine"] for one in found.values()), made


@pytest.mark.timeout(400)
@given(experiments())
@settings(max_examples=2, derandomize=True, phases=[Phase.generate])
def test_an_engine_one_host_and_many_hosts_give_the_same_bytes(
    made: dict[str, Any],
) -> None:
    holds(made)


@pytest.mark.slow
@pytest.mark.timeout(3600)
@given(experiments())
@settings(max_examples=50)
def test_of_fifty_experiments(made: dict[str, Any]) -> None:
    holds(made)


def test_a_verb_between_two_ticks(tmp_path: Path) -> None:
    """A robot that is put back while the clock is paused, and after the same tick."""
    at: list[int] = []

    def reset(clock: Clock) -> None:
        until(lambda: clock.tick.n > 3)
        with Session(Link(told.endpoint)) as session:
            fabric = Fabric(session)
            at.append(fabric.clock("pause"))
            until(lambda: {a["tick"] for a in fabric.agents()} == {at[0]})
            fabric.robot("a").reset()
            fabric.clock("pace", "fast")
            fabric.clock("resume")

    new = Experiment("verb", dt=0.1, duration=100.0, folder=PARTS)
    new.record = False
    new.input("wave", "parts.py:Wave", host=HERE)
    new.robot("a", "parts.py:Cart", "kinematic", command="input/wave")
    new.output("log", "csv", host=HERE)
    told = Told(reset)
    new.run(tmp_path / "processes", show=told, pace=5)
    assert not told.errors
    with new.engine(out=tmp_path / "engine") as engine:
        engine.step(at[0])
        engine["a"].reset()
        engine.run()
    recorded = [
        (tmp_path / way / "a.csv").read_bytes() for way in ("engine", "processes")
    ]
    assert 0 < at[0] < 1000
    assert recorded[0] == recorded[1]


# -- every experiment that the project shows -----------------------------------------


def in_three_ways(folder: Path, file: Path) -> list[str]:
    """Compare the ways of what a file runs, in a pinned process; what differs."""
    done = finished(
        [*PYTHON, "-m", "tests.engine.ways", str(file), str(folder / "out")],
        folder,
        environment(terminal()),
        seconds=900,
    )
    assert done.returncode == 0, done.stderr
    lines = [line for line in done.stdout.splitlines() if "files, of which" in line]
    assert lines or "drives devices" in done.stdout, done.stdout
    return [line for line in lines if not line.endswith("differ: none")]


SHOWN = [
    path
    for path in sorted([*EXAMPLES.glob("*.py"), *EXAMPLES.glob("*.toml"), DEMO])
    if path.name not in APART
]


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("file", SHOWN, ids=lambda file: file.name)
def test_every_example(tmp_path: Path, file: Path) -> None:
    assert in_three_ways(tmp_path, file) == []


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize(
    "page", [ROOT / "README.md", *sorted(ROOT.glob("docs/*.md"))], ids=lambda p: p.name
)
def test_every_experiment_of_a_page(tmp_path: Path, page: Path) -> None:
    """The blocks that run one, with what the page puts beside them."""
    scripts, files = blocks(page, "python") + blocks(page, "py"), blocks(page, "toml")
    for name in re.findall(r'"(\w+\.py):', "".join(files)):
        (tmp_path / name).write_text(scripts[0])
    (tmp_path / "keys.csv").write_text(KEYS)
    for text in blocks(page, "csv"):
        if text.startswith("time"):  # and not the list of a class
            (tmp_path / "keys.csv").write_text(text)
    for i, text in enumerate(blocks(page, "xml")):
        (tmp_path / ("arm.urdf" if not i else f"more{i}.xml")).write_text(text)
    found = []
    for i, text in enumerate([*scripts, *files]):
        file = tmp_path / f"block{i}.{'py' if i < len(scripts) else 'toml'}"
        file.write_text(text)
        runs = ".run(" in text if file.suffix == ".py" else text.startswith("[exp")
        if runs and page.name not in MORE:
            found += in_three_ways(tmp_path, file)
    assert found == []


WORLD = """
from rems_net import Experiment
lab = Experiment("world", dt="20 ms", duration="3 s", folder={folder!r})
lab.world(
    "arena",
    options={{
        "size": (1.6, 1.2),
        "balls": [{{"name": "ball", "radius": 0.03, "x": 0.2, "mass": 0.02}}],
        "boxes": [
            {{"name": "crate", "size": (0.06, 0.2, 0.06), "x": -0.3, "mass": 0.05}}
        ],
        "ramps": [
            {{"name": "ramp", "length": 0.3, "height": 0.03, "x": 0.2, "y": -0.3}}
        ],
    }},
)
lab.input("wheels", "parts.py:Wheels")
for i, name in enumerate(("left", "middle", "right")):
    lab.robot(name, "woodbot", {driver!r}, command="input/wheels", world="arena",
              initial={{"x": -0.1 * i, "y": 0.15 * i, "heading": 0.3 * i}})
lab.output("log", "csv")
lab.run()
"""

#: a crowd: hosts of more than 16 robots publish and answer in another way
CROWD = """
from rems_net import Experiment
lab = Experiment("crowd", dt="50 ms", duration="1 s", folder={folder!r})
lab.input("wave", "parts.py:Wave")
for i in range(240):
    lab.robot(f"r{{i}}", "parts.py:Cart", "kinematic", command="input/wave",
              initial={{"x": 0.01 * i}}, host=f"host{{i % 2}}", every=1 + i % 2)
lab.process("middle", "parts.py:Middle", carts="robot/*/state")
lab.robot("last", "parts.py:Cart", "kinematic", command="process/middle")
lab.output("log", "csv", host="log")
lab.run()
"""


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("driver", ["kinematic", "mujoco", "pybullet"])
def test_a_shared_world(tmp_path: Path, driver: str) -> None:
    if driver != "kinematic" and not find_spec(driver):
        pytest.skip(f"{driver} is not installed")
    (tmp_path / "world.py").write_text(WORLD.format(folder=str(PARTS), driver=driver))
    assert in_three_ways(tmp_path, tmp_path / "world.py") == []


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_a_crowd(tmp_path: Path) -> None:
    (tmp_path / "crowd.py").write_text(CROWD.format(folder=str(PARTS)))
    assert in_three_ways(tmp_path, tmp_path / "crowd.py") == []
