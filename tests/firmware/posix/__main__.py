"""Figures of the Woodbot's firmware as a process, measured on this machine.

python -m tests.firmware.posix                      everything, each fault once
python -m tests.firmware.posix --times 3            each fault three times
python -m tests.firmware.posix --only "router killed" --times 100
python -m tests.firmware.posix --latency 60         command to servo, for 60 s

CMake finds zenoh-pico by CMAKE_PREFIX_PATH. Its options: firmware/esp32_woodbot/pico.
"""

import argparse
import os
import statistics
import sys
import tempfile
import time
from pathlib import Path
from threading import Event

from tests.firmware.posix.building import build, missing
from tests.firmware.posix.driver import VALUES, Driver, pulse
from tests.firmware.posix.faults import FAULTS, trial
from tests.firmware.posix.robot import Robot
from tests.firmware.posix.scene import Scene
from tests.reliability.rig.rig import Rig


def recovery(program: Path, name: str, times: int) -> str:
    """One fault, so often, of one robot: a line of the table."""
    fault = FAULTS[name]
    with tempfile.TemporaryDirectory() as folder, Rig(Path(folder)) as rig:
        scene = Scene(rig, program)
        fault.prepare(scene)
        found, heap = [], []
        for _ in range(times):
            found.append(trial(scene, fault))
            heap.append(scene.robot.heap())
        resident = scene.robot.resident()
        scene.close()
    stood, back = zip(*found, strict=True)
    return (
        f"{name:40} {times:4} {max(stood):5.2f} {statistics.median(back):5.2f}"
        f" {max(back):5.2f} {heap[min(1, times - 1)]:6} {heap[-1]:6}"
        f" {resident / 1e6:5.1f}"
    )


def latencies(driver: Driver, robot: Robot) -> list[float]:
    """Seconds from each command that is put to the servo's new pulse."""
    found = []
    newest = {pulse(k): -1 for k in range(VALUES)}
    told = iter(enumerate(driver.told))
    k, at = next(told)
    left = 0
    for one in robot.pulses():
        while at <= one.at:
            newest[pulse(k)] = k
            k, at = next(told, (k, float("inf")))
        if one.left != left and newest.get(one.left, -1) >= 0:
            found.append(one.at - driver.told[newest[one.left]])
        left = one.left
    return found


def latency(program: Path, seconds: float) -> None:
    """A robot that is told something else every 20 ms: latency, CPU and memory."""
    with tempfile.TemporaryDirectory() as folder, Rig(Path(folder)) as rig:
        scene = Scene(rig, program)
        scene.serve()
        robot = scene.start()
        driver = scene.drive()
        Event().wait(1.0)
        used, begun = cpu(robot.process.pid), time.monotonic()
        Event().wait(seconds)
        share = (cpu(robot.process.pid) - used) / (time.monotonic() - begun)
        found = sorted(1e3 * one for one in latencies(driver, robot))
        heap, resident = robot.heap(), robot.resident()
        scene.close()
    median, late = found[len(found) // 2], found[int(0.99 * len(found))]
    print(
        f"command to servo, of {len(found)}: median {median:.1f} ms, "
        f"p99 {late:.1f} ms, worst {found[-1]:.1f} ms"
    )
    print(
        f"one robot at 50 Hz: {100 * share:.1f} % of a core, {heap / 1e3:.0f} kB of "
        f"heap, {resident / 1e6:.1f} MB resident"
    )


def cpu(pid: int) -> float:
    """Seconds of processor time that a process has taken."""
    text = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8")
    fields = text.rpartition(") ")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m tests.firmware.posix",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--times", type=int, default=1, help="trials of each fault")
    parser.add_argument("--only", choices=FAULTS, help="one fault")
    parser.add_argument("--latency", type=float, default=20.0, help="for how long [s]")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        program, words = (Path(), missing()) if missing() else build(Path(folder))
        if words:
            print(words, file=sys.stderr)
            return 1
        if not args.only:
            latency(program, args.latency)
        print(f"{'fault':40}    n stood  back worst   heap    end    MB", flush=True)
        for name in [args.only] if args.only else FAULTS:
            print(recovery(program, name, args.times), flush=True)
        print(
            "stood, back: seconds of wall time; heap: bytes after the second, the last"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
