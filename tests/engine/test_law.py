"""One law: an engine, one host and many hosts give the same bytes."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rems_net import Experiment
from rems_net.agents.experiment.show import Show

PARTS = Path(__file__).parent
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
    }


def lab(made: dict[str, Any], host: str | None) -> Experiment:
    """Return this experiment; host: one process for all agents, or each its own."""
    carts, more = list(made["commands"]), {}
    if host:
        more = {"host": host}
    new = Experiment(
        "law", dt=made["dt"], duration=2.0, seed=made["seed"], folder=PARTS
    )

    def rates(name: str) -> dict[str, Any]:
        return {"every": made["every"][name], "since": made["since"][name], **more}

    new.input("wave", "parts.py:Wave", pause=made["pause"], **rates("wave"))
    new.input("slow", "parts.py:Slow", **rates("slow"))
    new.input("stick", "parts.py:Stick", **rates("stick"))
    for name, command in made["commands"].items():
        new.robot(
            name,
            "parts.py:Cart",
            "kinematic",
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
    new.output("log", "csv", **more)
    return new


def holds(made: dict[str, Any]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        found = {}
        for way in ("engine", "one", "many"):
            out = Path(folder, way)
            new = lab(made, "all" if way == "one" else None)
            new.run(out, direct=way == "engine", show=Show())
            found[way] = {p.name: p.read_bytes() for p in sorted(out.glob("*.csv"))}
        assert len(found["engine"]) == len(made["commands"])
        assert found["engine"] == found["one"] == found["many"], made


@given(experiments())
@settings(max_examples=2, deadline=None, derandomize=True)
def test_an_engine_one_host_and_many_hosts_give_the_same_bytes(
    made: dict[str, Any],
) -> None:
    holds(made)


@pytest.mark.slow
@pytest.mark.timeout(3600)
@given(experiments())
@settings(max_examples=50, deadline=None)
def test_of_fifty_experiments(made: dict[str, Any]) -> None:
    holds(made)
