"""A driven robot in whole runs: real processes, a real clock, a device that listens."""

import csv
import re
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import rems_net
from rems_net import Experiment
from rems_net.agents.protocol.plan import HERE
from rems_net.errors import AgentError, uncoded
from rems_net.router.message import pack, pack_stamp
from tests.agents.runs import Told, relatives, until
from tests.drivers.hardware.cart import Device

FOLDER = Path(__file__).parent
#: seconds that a busy machine may take besides
BUSY = 1.0


@pytest.fixture(autouse=True)
def nothing_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """After every test: no process, not even one that a call of its device holds."""
    monkeypatch.setenv("PARTS_MARK", str(tmp_path))
    yield
    assert not relatives(f"PARTS_MARK={tmp_path}")


def lab(
    device: Device,
    seconds: float,
    driver: str = "SerialCart",
    stick_fails_at: int = 0,
    **options: Any,
) -> Experiment:
    made = Experiment("hw", dt=0.02, duration=seconds, pace=1, folder=FOLDER)
    made.record = False
    stick = {"fail_at": stick_fails_at}
    host = "stick" if stick_fails_at else HERE
    made.input("stick", "parts.py:Ahead", options=stick, host=host)
    made.robot(
        "b",
        "parts.py:Cart",
        f"parts.py:{driver}",
        command="input/stick",
        options={"port": str(device.link)} | options,
    )
    made.output("csv", "csv", host=host)
    return made


def run(
    made: Experiment, folder: Path, beside: Callable[[Any], None] | None = None
) -> Told:
    told = Told(beside)
    try:
        made.run(folder / "out", show=told)
    finally:
        if told._thread is not None:
            told._thread.join()
    assert not told.errors, told.errors
    return told


def speeds(device: Device, since: float) -> list[tuple[float, float]]:
    """When it was told which speed."""
    return [(n["t"], n["heard"][0]) for n in device.heard(since)]


def test_a_run(tmp_path: Path) -> None:
    with Device(tmp_path) as device:
        told = run(lab(device, 1.2), tmp_path)
        assert device.speed == 0.0
    assert len([line for line in told.lines if " exchanges at 50 Hz" in line]) == 1
    with (tmp_path / "out" / "b.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert float(rows[-1]["state/x [m]"]) > 0.1


def test_stop_and_pause(tmp_path: Path) -> None:
    moments: dict[str, float] = {}

    def beside(clock: Any) -> None:
        until(lambda: device.speed == 0.5)
        with rems_net.join() as fabric:
            moments["stop"] = time.monotonic()
            fabric.stop()
            until(lambda: device.speed == 0.0)
            moments["go"] = time.monotonic()
            fabric.release()
            until(lambda: device.speed == 0.5)
            assert fabric.robot("b").figures()["cycles"] > 0
            fabric.clock("pause")
            moments["pause"] = time.monotonic()
            until(lambda: device.speed == 0.0)
            moments["resume"] = time.monotonic()
            fabric.clock("resume")
            until(lambda: device.speed == 0.5)
            fabric.clock("end")

    with Device(tmp_path) as device:
        run(lab(device, 60.0), tmp_path, beside)
        stood = next(t for t, v in speeds(device, moments["stop"]) if not v)
        assert stood - moments["stop"] < 0.1 + BUSY
        assert not any(v for t, v in speeds(device, stood) if t < moments["go"]), (
            "it moves while it is stopped"
        )
        stood = next(t for t, v in speeds(device, moments["pause"]) if not v)
        assert stood - moments["pause"] < 0.5 + BUSY
        assert device.speed == 0.0


def test_an_exception_beside_it(tmp_path: Path) -> None:
    with Device(tmp_path) as device:
        with pytest.raises(AgentError) as caught:
            run(lab(device, 60.0, stick_fails_at=30), tmp_path)
        assert str(caught.value).startswith("input/stick: RuntimeError: the stick")
        assert 0.5 in [v for _, v in speeds(device, 0.0)]
        assert device.speed == 0.0


def test_an_exception_in_the_driver(tmp_path: Path) -> None:
    with Device(tmp_path) as device:
        made = lab(device, 60.0, how="exception", fail_at=30)
        with pytest.raises(AgentError) as caught:
            run(made, tmp_path)
        assert re.fullmatch(
            r"robot/b: ZeroDivisionError: wheels fell off "
            r"\(parts\.py, line \d+, in fail, tick \d+\)",
            uncoded(caught.value),
        )
        assert device.speed == 0.0


def test_unplugged_in_the_middle(tmp_path: Path) -> None:
    def beside(clock: Any) -> None:
        until(lambda: device.speed == 0.5)
        gone = device.tell("unplug 1")
        until(lambda: device.heard(gone + 0.5))
        until(lambda: device.speed == 0.5)
        with rems_net.join() as fabric:
            fabric.clock("end")

    with Device(tmp_path) as device:
        told = run(lab(device, 60.0), tmp_path, beside)
        assert device.speed == 0.0
    lost = [x for x in told.of("device") if "has lost its device" in x]
    assert lost
    assert lost[0].startswith("robot/b has lost its device (")
    # Once for each outage; a machine that is very busy may add one of its own.
    assert sum("is back after" in x for x in told.of("device")) == len(lost)


def test_a_run_ends_while_a_call_hangs(tmp_path: Path) -> None:
    """Its host ends, too: nothing of the device holds it."""

    def beside(clock: Any) -> None:
        until(lambda: device.speed == 0.5)
        device.tell("hang 60")
        until(lambda: any("receives nothing" in x for x in told.of("device")))
        with rems_net.join() as fabric:
            fabric.clock("end")

    with Device(tmp_path) as device:
        told = Told(beside)
        with pytest.raises(AgentError) as caught:
            lab(device, 60.0, "BareCart").run(tmp_path / "out", show=told)
    assert re.search(r"exchange\(\) hangs for \d\.\d s \(parts\.py", str(caught.value))
    assert "switch it off" in str(caught.value)


def test_a_stamp_of_the_future_moves_no_device(tmp_path: Path) -> None:
    """A command that is stamped far ahead of the clock would be young for ever."""
    with Device(tmp_path) as device:
        lab = Experiment("hw", dt=0.02, duration=20.0, pace=1, folder=FOLDER)
        lab.record = False
        options = {"port": str(device.link)}
        lab.robot("b", "parts.py:Cart", "parts.py:SerialCart", options=options)
        told_speeds: list[set[float]] = []

        def command(clock: Any) -> None:
            with rems_net.join(at=told.endpoint) as fabric:
                value = pack({"speed": 0.5, "turn": 0.0})
                for ahead in (10**9, 0):
                    begun, first = time.monotonic(), clock.tick.n
                    while clock.tick.n < first + 25:
                        n = clock.tick.n + ahead
                        publisher = fabric.session.publisher("rems/robot/b/command")
                        publisher.put(value, pack_stamp(n, n / 50))
                        threading.Event().wait(0.02)
                    told_speeds.append({speed for _, speed in speeds(device, begun)})
                fabric.clock("end")

        told = Told(command)
        lab.run(tmp_path / "out", show=told)
        assert not told.errors, told.errors
    assert told_speeds[0] <= {0.0}
    assert 0.5 in told_speeds[1]
