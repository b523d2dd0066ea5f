"""A robot without a watchdog stands still when its host can no longer stop it."""

import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from rems_net.emulators.emulator import Emulator
from tests.agents.runs import relatives, until
from tests.drivers.hardware.kinds import KINDS, Kind
from tests.signals import KILL, freeze, thaw

#: s: what a robot may take to stand, and what a busy machine is granted in CI
LIMIT, BUSY = 0.6, 0.5
#: s: what the start of a process may take besides; a second under Wine
START = 3.0 if sys.platform == "win32" else 0.0
UNGUARDED = [name for name, kind in KINDS.items() if not kind.guarded]
#: s between two looks at the robot
LOOK = 0.002

Host = subprocess.Popen[bytes]


@contextmanager
def driving(name: str, folder: Path) -> Iterator[tuple[Kind, Any, Host]]:
    """An emulated robot that a program of its own drives ahead; all end with this."""
    kind = KINDS[name]
    mark = f"HELD_MARK={folder}"
    with Emulator(kind.device(), kind.line(folder)) as emulator:
        process = subprocess.Popen(
            [sys.executable, "-m", "tests.drivers.hardware.host", name, emulator.where],
            env=os.environ | dict([mark.split("=", 1)]),
            start_new_session=True,
        )
        try:
            until(lambda: goes(kind, emulator))
            yield kind, emulator, process
        finally:
            process.kill()
            process.wait()
        until(lambda: not relatives(mark))


def kill_group(process: Host) -> None:
    """Kill a program and all in its process group."""
    if sys.platform == "win32":
        pytest.skip("Windows has no process groups that a signal ends")
    os.killpg(process.pid, KILL)


def goes(kind: Kind, emulator: Any) -> bool:
    return bool(kind.told(emulator)) and kind.obeys(emulator) == kind.goes


def standing(kind: Kind, emulator: Any, begun: float) -> float:
    """How long after `begun` it stands; it goes on standing for a while."""
    pause = threading.Event()
    while kind.obeys(emulator) != kind.stands:
        assert time.monotonic() < begun + 5, "it drives on"
        pause.wait(LOOK)
    seconds = time.monotonic() - begun
    while time.monotonic() < begun + seconds + 0.3:
        assert kind.obeys(emulator) == kind.stands
        pause.wait(LOOK)
    return seconds


@pytest.mark.parametrize("name", UNGUARDED)
@pytest.mark.parametrize("how", ["killed", "frozen", "its group killed"])
def test_it_stands_without_its_host(name: str, how: str, tmp_path: Path) -> None:
    with driving(name, tmp_path) as (kind, emulator, process):
        begun = time.monotonic()
        if how == "its group killed":
            kill_group(process)
        elif how == "frozen":
            freeze(process.pid)
        else:
            process.kill()
        assert standing(kind, emulator, begun) < LIMIT + BUSY
        if how == "frozen":  # and it obeys again
            thaw(process.pid)
            until(lambda: goes(kind, emulator))


@pytest.mark.parametrize("name", UNGUARDED)
@pytest.mark.parametrize("how", ["killed", "frozen"])
def test_it_stands_without_the_process_that_holds_its_port(
    name: str, how: str, tmp_path: Path
) -> None:
    """The driver halts it at once, and starts another such process."""
    with driving(name, tmp_path) as (kind, emulator, process):
        holders = {*relatives(f"HELD_MARK={tmp_path}")} - {process.pid}
        # Windows has a program for each console, too, which ends with its holder.
        assert len(holders) == 1 or sys.platform == "win32"
        stood, begun = kind.history(emulator).count(kind.stands), time.monotonic()
        for pid in holders:
            freeze(pid) if how == "frozen" else os.kill(pid, KILL)
        # On a busy machine it may stand for less than the time between two looks.
        until(lambda: kind.history(emulator).count(kind.stands) > stood)
        assert time.monotonic() - begun < LIMIT + BUSY + START
        until(lambda: goes(kind, emulator))
