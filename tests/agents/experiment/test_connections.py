"""Connections to oneself, to each other, by globs, and without a schema."""

from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment
from rems_net.errors import ExperimentError, uncoded
from tests.agents.runs import PARTS, Told

HERE = "experiment/linked.py"


def lab() -> Experiment:
    return Experiment("linked", dt=0.1, duration="1 s", folder=PARTS)


def lines(folder: Path) -> list[list[str]]:
    text = (folder / "lines.txt").read_text(encoding="utf-8")
    return [line.split() for line in text.splitlines()]


def test_who_is_connected_to_itself_hears_the_step_before(tmp_path: Path) -> None:
    linked = lab()
    for name, cls, every in (
        ("sum", "Sum", 1),
        ("slow", "Sum", 3),
        ("again", "Again", 1),
    ):
        more: dict[str, Any] = {} if cls == "Again" else {"before": f"process/{name}"}
        linked.process(name, f"{HERE}:{cls}", every=every, **more)
    linked.output("lines", f"{HERE}:Lines")
    linked.run(tmp_path, direct=True)
    heard = lines(tmp_path)
    for name in ("sum", "again"):
        said = [int(n) for _, key, n in heard if key == f"process/{name}/value"]
        assert said == list(range(1, 11))
    said = [int(n) for _, key, n in heard if key == "process/slow/value"]
    assert said == [0, 0, 1, 1, 1, 2, 2, 2, 3, 3]


def test_a_loop_within_a_phase_reads_the_tick_before() -> None:
    """Two processes that read each other: neither waits."""
    linked = lab()
    linked.process("a", f"{HERE}:Sum", before="process/b")
    linked.process("b", f"{HERE}:Sum", before="process/a")
    with linked.engine() as engine:
        engine.step(5)
        assert [engine[name].value.n for name in "ab"] == [5, 5]


def test_what_one_hears_of_oneself_is_checked() -> None:
    linked = lab()
    linked.robot("cart", "parts.py:Cart", "parts.py:Euler", command="robot/cart/state")
    with pytest.raises(ExperimentError) as caught:
        linked.check()
    assert str(caught.value).startswith(
        "robot 'cart': robot/cart/state (cart.state) cannot become robot/cart/command"
    )


def test_a_glob_names_the_others(tmp_path: Path) -> None:
    linked = lab()
    for name in "abc":
        linked.process(name, f"{HERE}:Neighbours")
    linked.output("lines", f"{HERE}:Lines")
    linked.run(tmp_path, direct=True)
    assert {n for t, _, n in lines(tmp_path) if t != "1"} == {"2"}


def test_a_glob_on_an_in_with_a_schema_names_one_port() -> None:
    linked = lab()
    for name in ("a", "b"):
        linked.robot(name, "parts.py:Cart", "parts.py:Euler")
    linked.process(
        "dog", "parts.py:Follow", leader="robot/*/state", me="robot/b*/state"
    )
    with pytest.raises(ExperimentError) as caught:
        linked.check()
    assert uncoded(caught.value) == (
        "process 'dog': its In 'leader' has a schema, so it reads one port, and "
        "'robot/*/state' matches 2: robot/a/state, robot/b/state. Name one of them, "
        "or leave the schema out: In() takes all that match."
    )
    for name in ("c", "d", "e"):
        linked.input(name, "parts.py:Steady")
    linked.plans["process/dog"].sources["leader"] = "robot/a/*te"
    linked.robot("f", "parts.py:Cart", "parts.py:Euler", command="input/*")
    with pytest.raises(ExperimentError) as caught:
        linked.check()
    assert str(caught.value) == (
        "robot 'f': its In 'command' has a schema, so it reads one port, and 'input/*' "
        "matches 3: input/c/value, input/d/value, input/e/value. Name one of them."
        " (R0419)"
    )


def test_a_glob_that_matches_one_port_is_heard_across_processes(tmp_path: Path) -> None:
    linked = lab()
    linked.input("wave", "parts.py:Wave")
    cart = ("parts.py:Cart", "parts.py:Euler")
    linked.record = False
    linked.robot("cart", *cart, command="input/wa*", host="here")
    linked.output("log", "parts.py:Log", host="here")
    linked.run(tmp_path)
    last = (tmp_path / "log.txt").read_text(encoding="utf-8").splitlines()[-2].split()
    assert last[:3] == ["10", "robot/cart/command", "0.5"]


@pytest.mark.parametrize(
    "source", ["robot/[ab]/state", "robot/a?/state", "robot", "a b/c"]
)
def test_what_is_no_glob_is_told(source: str) -> None:
    linked = lab()
    linked.process("far", f"{HERE}:Far", where=source)
    with pytest.raises(ExperimentError) as caught:
        linked.check()
    assert str(caught.value) == (
        f"process 'far': process/far.where is connected to {source!r}; expected "
        "<kind>/<name> or <kind>/<name>/<port>, such as 'input/keys' or "
        "'robot/sim/state', or a glob such as 'robot/ca*/state', where * is any "
        "letters."
        " (R0422)"
    )


def test_an_in_without_a_schema_takes_that_of_its_one_source(tmp_path: Path) -> None:
    linked = lab()
    linked.record = False
    linked.input("drive", "parts.py:Steady", host="here")
    cart = ("parts.py:Cart", "parts.py:Euler")
    linked.robot("cart", *cart, command="input/drive", host="here")
    linked.process("far", f"{HERE}:Far", where="robot/cart/state")
    linked.output("lines", f"{HERE}:Lines", host="here")
    linked.output("log", "parts.py:Log", host="here")
    told = Told()
    linked.run(tmp_path, show=told)
    assert [line.partition("] ")[2] for line in told.said] == ["DefDict[cart.state] m"]
    log = (tmp_path / "log.txt").read_text(encoding="utf-8").splitlines()
    x = [float(row.split()[2]) for row in log if "cart/state" in row]
    assert [float(n) / 100 for _, _, n in lines(tmp_path)] == pytest.approx(x)
