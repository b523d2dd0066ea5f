"""Every benchmark still runs, tiny; its results are in measured/performance.md."""

import importlib.util
import sys
from pathlib import Path

import pytest

from benchmarks.__main__ import main
from benchmarks.contest import Contender, ProgramError, Spread, interleave, run
from benchmarks.report import Section, Target, write

PEERS = {"zmq": "zmq_push", "dora": "dora_rs", "ray": "ray_actors"}


def test_a_ratio_is_of_neighbouring_runs() -> None:
    table = interleave([], 1, print)
    table.runs = {"a": [{"rate": 2}, {"rate": 9}], "b": [{"rate": 1}, {"rate": 3}]}
    assert table.ratio("a", "b") == Spread((2.0, 3.0))
    assert table.ratio("a", "b").show() == "2.50 (2.00 to 3.00)"


def test_a_run_that_failed_is_in_no_pair() -> None:
    table = interleave([], 1, print)
    table.runs = {"a": [{"rate": 2}, {}], "b": [{"rate": 1}, {"rate": 3}]}
    assert table.ratio("a", "b") == Spread((2.0,))
    assert table.spread("a") == Spread((2.0,))


def test_a_target_is_a_bound_from_either_side() -> None:
    assert Target("", Spread((0.6, 0.8, 0.9)), 0.7).reached
    assert not Target("", Spread((0.6, 0.8, 0.9)), 0.7, at_least=False).reached


def test_the_page_keeps_what_was_not_measured(tmp_path: Path) -> None:
    page = tmp_path / "performance.md"
    order = ["lockstep", "swarm"]
    write(page, {"swarm": Section("swarm", "Swarm", ["old"])}, order)
    write(page, {"lockstep": Section("lockstep", "Lock-step", ["new"])}, order)
    text = page.read_text(encoding="utf-8")
    assert text.index("new") < text.index("old")
    write(page, {"swarm": Section("swarm", "Swarm", ["newer"])}, order)
    assert "old" not in page.read_text(encoding="utf-8")


def test_a_program_that_fails_says_why() -> None:
    with pytest.raises(ProgramError, match=r"raw: ValueError: .*'many'"):
        run(Contender("raw", "raw_zenoh", ("many", "1")))


def test_one_that_does_not_exist_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["speed"])
    assert "no benchmark 'speed'; there is lockstep" in capsys.readouterr().err


@pytest.mark.parametrize("size", [1, 3])
def test_every_state_is_received(size: int) -> None:
    assert run(Contender("rems_net", "rems", (size, 20)))["lost"] == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "lockstep",
        "swarm",
        "latency",
        "realtime",
        "start",
        "numerics",
        "learning",
        "recording",
        "worlds",
        "gym",
        "dashboard",
        "hand",
    ],
)
def test_it_runs(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([name, "--quick"]) == 0
    assert f"<!-- benchmark: {name} -->" in capsys.readouterr().out


@pytest.mark.slow
def test_the_footprint_is_measured(capsys: pytest.CaptureFixture[str]) -> None:
    if not sys.platform.startswith("linux"):
        pytest.skip("memory and CPU time are read from /proc, which only Linux has")
    assert main(["footprint", "--quick"]) == 0
    assert "Left out" not in capsys.readouterr().out


@pytest.mark.slow
def test_the_picture_is_drawn(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("matplotlib", reason="drawing needs the extra `plot`")
    assert main(["size", "--quick"]) == 0
    assert "![" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize("package", PEERS)
def test_a_peer_runs(package: str) -> None:
    if importlib.util.find_spec(package) is None:
        pytest.skip(f"{package} is not installed: the extra `bench` brings it")
    assert run(Contender(package, PEERS[package], (2, 50)))["rate"] > 0
