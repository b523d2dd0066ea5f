"""A Woodbot's short way in each physics engine, to the last bit: tests/golden/physics.

`woodbot-<engine>.csv` has state and sensors every 0.1 s of a way ahead, along a curve,
into the wall and about. Its first line says what computed it: that version of the
engine, with that C library, and no other, gives these numbers. They change only when
what the engine is told does, or Woodbot: `python -m tests.drivers.physics.golden`.
They are computed in a process that was started pinned, so every processor gives them.
"""

import os
import platform
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

from rems_net.agents.robot import Driver
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.drivers.physics.pybullet import Pybullet
from rems_net.maths.numerics import environment
from tests.robots.figures import drive, woodbot

FOLDER = Path(__file__).parents[2] / "golden" / "physics"
ENGINES: dict[str, type[Driver]] = {"mujoco": Mujoco, "pybullet": Pybullet}
#: shares of full speed, left and right, for 0.5 s each
COURSE = ((1.0, 1.0), (0.3, 1.0), (1.0, 1.0), (-1.0, 0.6))


def file(engine: str) -> Path:
    """Return where the way in this engine is kept."""
    return FOLDER / f"woodbot-{engine}.csv"


def computed_by(engine: str) -> str:
    """Return what the numbers depend on: the engine, the processor, the C library."""
    library = " ".join(platform.libc_ver()) or platform.version()
    machine = f"{platform.system()} {platform.machine()}"
    return f"# {engine} {version(engine)}, {machine}, {library}, pinned"


def rows(engine: str) -> list[str]:
    """Return the lines of its file, computed in a pinned process."""
    command = [sys.executable, "-m", "tests.drivers.physics.golden", engine]
    env = environment(os.environ)
    done = subprocess.run(command, env=env, check=True, stdout=subprocess.PIPE)
    return done.stdout.decode().splitlines()


def driven(engine: str) -> list[str]:
    """Drive it, and return the lines of its file: each number to the last bit."""
    initial = {"x": 0.2, "y": 0.05, "heading": 0.3}
    with woodbot(ENGINES[engine], initial=initial) as robot:
        ports = (robot.state, robot.sensors)
        found = [computed_by(engine), ",".join(p for at in ports for p in at.flat())]
        for left, right in COURSE:
            for _ in range(5):
                drive(robot, left, right)
                found.append(",".join(repr(v) for at in ports for v in at.leaves()))
    return found


def main() -> None:
    """Print the lines for an engine, or write all files anew."""
    if len(sys.argv) > 1:
        print("\n".join(driven(sys.argv[1])))
        return
    FOLDER.mkdir(exist_ok=True)
    for engine in ENGINES:
        file(engine).write_text("\n".join(rows(engine)) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
