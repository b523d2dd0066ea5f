"""Figures of inverse kinematics: `python -m tests.kinematics.figures [TARGETS]`."""

import sys
import time
from dataclasses import dataclass

import numpy as np

from rems_net.errors import UnreachableError
from rems_net.kinematics.arm import Arm
from tests.kinematics.arms import ARMS, anywhere

COLUMNS = ("arm", "targets", "reached", "worst error", "median", "longest")
HEAD = f"| {' | '.join(COLUMNS)} |\n{'|---' * len(COLUMNS)}|"


@dataclass(frozen=True, slots=True)
class RoundTrips:
    """worst: of position and rotation matrix, m and 1      times: of the process, ms"""

    asked: int
    reached: int
    worst: float
    median: float
    longest: float


def round_trips(arm: Arm, count: int) -> RoundTrips:
    """Ask for poses of random joints, from other random joints."""
    random = np.random.default_rng(2026)
    worst, times = 0.0, []
    for _ in range(count):
        pose, start = arm.fk(anywhere(arm, random)), anywhere(arm, random)
        begun = time.process_time()
        try:
            found = arm.ik(pose, start=start)
        except UnreachableError:
            continue
        times.append(1000 * (time.process_time() - begun))
        q = np.array([*found.joints.values()])
        assert (q >= arm.low).all()
        assert (q <= arm.high).all()
        there = arm.fk(q.tolist())
        away = np.abs(there.position - pose.position).max()
        turned = np.abs(there.rotation - pose.rotation).max()
        worst = max(worst, float(away), float(turned))
    median = float(np.median(times))
    return RoundTrips(count, len(times), worst, median, max(times))


def row(name: str, found: RoundTrips) -> str:
    """Return a line of the table."""
    share = 100 * found.reached / found.asked
    return (
        f"| {name} | {found.asked} | {share:.2f} % | {found.worst:.1e} | "
        f"{found.median:.2f} ms | {found.longest:.1f} ms |"
    )


if __name__ == "__main__":
    targets = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    print(HEAD)
    for name, make in ARMS.items():
        print(row(name, round_trips(make(), targets)), flush=True)
