"""A class of emulated robots on one router: driven, led, left alone, measured."""

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from rems_net.client import Fabric, join
from rems_net.firmware.fleet import Fleet
from tests.agents.runs import until
from tests.commands import command
from tests.firmware.emulated.scene import Driver, Serve, Servos, compiled, ported, pulse

#: s of wall time in which a robot stands still that nobody drives any more; its
#: max_age is 0.5 s, and a busy machine takes its own time
STANDS, STANDS_BUSY = 0.6, 3.0
#: s over which processors and latencies are looked at
LOOK = 2.5


@contextmanager
def fleet(
    count: int, folder: Path, program: Path | None = None
) -> Iterator[tuple[Serve, Fleet, Fabric]]:
    """So many robots on an open fabric, and somebody who has joined it."""
    compiled()
    names = [f"woodbot-{i + 1}" for i in range(count)]
    with Serve() as serve, join(at=serve.endpoint) as fabric:
        robots = Fleet(fabric.session, names, print, servos=folder, program=program)
        with robots:
            until(lambda: len(robots.look()) == count, 60)
            until(lambda: len(fabric.agents()) == count, 60)
            yield serve, robots, fabric


def drive_all(serve: Serve, fabric: Fabric, folder: Path, count: int) -> None:
    """Each is driven through the fabric, and stands when nobody does any more."""
    names = [f"woodbot-{i + 1}" for i in range(count)]
    robots = [fabric.robot(name) for name in names]
    servos = [Servos(folder, name) for name in names]

    def all_drive() -> bool:
        for robot in robots:
            robot.command = {"wheel/left": 3.0, "wheel/right": 2.0}
        return all(one.drives for one in servos)

    until(all_drive, 60)
    until(lambda: all(robot.state.x > 0 for robot in robots))
    until(lambda: not any(one.drives for one in servos), STANDS_BUSY)


def kill_their_driver(serve: Serve, folder: Path, count: int) -> list[float]:
    """Seconds that each goes on when who drives it is killed."""
    names = [f"woodbot-{i + 1}" for i in range(count)]
    servos = [Servos(folder, name) for name in names]
    driver = subprocess.Popen(
        [sys.executable, "-m", "tests.firmware.emulated.scene", serve.endpoint, *names]
    )
    until(lambda: all(one.drives for one in servos), 60)
    driver.kill()
    killed = time.monotonic()
    driver.wait()
    until(lambda: not any(one.drives for one in servos), STANDS_BUSY)
    return [one.rows()[-1][0] - killed for one in servos]


LAB = """\
[experiment]
name = "team3"
dt = "20 ms"
pace = 1.0
[[input]]
name = "keys"
type = "csv"
options.file = "keys.csv"
"""
ROBOT = """
[[robot]]
name = "{name}"
definition = "woodbot"
driver = "remote"
command = "input/keys"
"""
KEYS = """\
time [s],command/wheel/left [rad/s],command/wheel/right [rad/s]
600,3,2
"""


def strays(one: Servos) -> bool:
    """Whether it drives otherwise than its run says; on a busy machine it may stand."""
    return one.drives and one.rows()[-1][1] != pulse(3.0)


def lead_some(serve: Serve, folder: Path) -> None:
    """A team's run drives two, which nobody else does meanwhile, until it is killed."""
    led = ["woodbot-1", "woodbot-2"]
    robots = [ROBOT.format(name=name) for name in led]
    (folder / "team3.toml").write_text("".join([LAB, *robots]), encoding="utf-8")
    (folder / "keys.csv").write_text(KEYS, encoding="utf-8")
    servos = [Servos(folder, name) for name in led]
    run = subprocess.Popen(
        command("run", "team3.toml", "--fabric", "team3"),
        cwd=folder,
        env=os.environ | {"REMS_ROUTER": serve.endpoint},
        stdout=subprocess.DEVNULL,
    )
    try:
        until(lambda: all(one.drives for one in servos), 60)
        until(lambda: all(one.rows()[-1][1] == pulse(3.0) for one in servos))
        with Driver(serve.endpoint, *led, every=0.02), pytest.raises(AssertionError):
            until(lambda: any(map(strays, servos)), 1.0)
    finally:
        run.kill()
        run.wait()
    until(lambda: not any(one.drives for one in servos), STANDS_BUSY)
    with Driver(serve.endpoint, *led):
        until(lambda: all(one.drives for one in servos), 60)


def latencies(serve: Serve, folder: Path, count: int) -> list[float]:
    """Seconds from a put to the pulse that it leads to, of all robots [s]."""
    names = [f"woodbot-{i + 1}" for i in range(count)]
    with Driver(serve.endpoint, *names, every=0.1) as driver:
        until(lambda: all(Servos(folder, name).drives for name in names), 60)
        begun = time.monotonic()
        until(lambda: time.monotonic() > begun + LOOK, LOOK + 1)
    found = []
    for name in names:
        rows = [row for row in Servos(folder, name).rows() if row[0] > begun]
        for said, speed in driver.said:
            wanted = pulse(speed)
            hits = (t - said for t, left, _ in rows if t > said and left == wanted)
            if said > begun and (took := next(hits, 9.0)) < 2.0:
                found.append(took)
    assert len(found) > count * LOOK / 0.1 / 2
    return sorted(found)


def cpu(pids: list[int]) -> float:
    """Seconds of processor that they have used."""
    total = 0
    for pid in pids:
        words = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").split()
        total += int(words[13]) + int(words[14])
    return total / 100


def memory(pids: list[int]) -> float:
    """MB of memory that are theirs alone, and their share of what is not."""
    total = 0
    for pid in pids:
        text = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii")
        line = next(one for one in text.splitlines() if one.startswith("Pss:"))
        total += int(line.split()[1])
    return total / 1024


def measure(serve: Serve, robots: Fleet, folder: Path, count: int) -> str:
    """What one costs while all are driven, and how fast commands get there."""
    before, begun = cpu(robots.pids), time.monotonic()
    took = latencies(serve, folder, count)
    share = (cpu(robots.pids) - before) / (time.monotonic() - begun)
    p99 = took[int(len(took) * 0.99)]
    return (
        f"{count} robots: command to servo {1000 * statistics.median(took):.1f} ms "
        f"(median), {1000 * p99:.1f} ms (p99); a robot takes "
        f"{100 * share / count:.1f} % of a core, {memory(robots.pids) / count:.1f} MB"
    )


def stand_in_for_a_class(folder: Path, count: int, program: Path | None) -> float:
    """All of it; how long the slowest went on without who drove it [s]."""
    with fleet(count, folder, program) as (serve, robots, fabric):
        drive_all(serve, fabric, folder, count)
        stood = max(kill_their_driver(serve, folder, count))
        print(f"stood {stood:.2f} s after their driver was killed, at the latest")
        lead_some(serve, folder)
        print(measure(serve, robots, folder, count))
    return stood


def test_a_few(tmp_path: Path) -> None:
    stand_in_for_a_class(tmp_path, 3, None)


def test_a_few_over_zenoh_pico(tmp_path: Path) -> None:
    stand_in_for_a_class(tmp_path, 3, ported())


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_a_class(tmp_path: Path) -> None:
    assert stand_in_for_a_class(tmp_path, 30, None) < STANDS


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_a_class_over_zenoh_pico(tmp_path: Path) -> None:
    assert stand_in_for_a_class(tmp_path, 30, ported()) < STANDS
