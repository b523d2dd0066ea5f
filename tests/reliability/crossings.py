"""Crossings: who goes silent, by robot. Does it stand, and what is said of it?

Each cell is tried on a real run: it drives, somebody goes silent, and another person
says STOP. The columns are the drivers of rems_net's own registry, so that a new driver
without a column fails a test.
"""

import re
import signal
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
from pathlib import Path

from tests.reliability.page import Section, table
from tests.reliability.rig.programs import send, until
from tests.reliability.rig.rig import Rig
from tests.reliability.rows import COMMANDER, DRIVEN, LIMIT, ROWS, Fault
from tests.reliability.scene import Scene
from tests.reliability.simulated import SimulatedScene

#: s. Somebody else says STOP so long after the fault; and the fault ends after this.
ASKED, LASTS = 1.0, 3.0
#: s. After the fault and a release, the robot moves again within this.
BACK = 12.0

#: driver -> its column, or in five words why it has none
DRIVERS = {
    "kinematic": "kinematic",
    "mujoco": "mujoco",
    "create2": "create2",
    "dynabot": "dynabot",
    "woodbot-ws": "woodbot-ws",
    "remote": "remote",
    "pybullet": "no: steps as MuJoCo does",
    "scaler": "no: servos as of dynabot",
    "webcam": "no: it does not move",
    "webots": "no: there is no Webots",
}
#: columns: the robots of `robots.py`, and one that a run elsewhere drives
ROBOTS = [name for name in DRIVERS.values() if not name.startswith("no: ")]
SIMULATED = {"kinematic", "mujoco"}


@dataclass(frozen=True)
class Silence:
    """Somebody who goes silent.

    said: what the screens must name.  without: why a robot has no cell, by robot.
    mends: whether rems_net ends it by itself: the robot stands, and drives on
    """

    fault: Fault
    said: str
    without: Mapping[str, str] = field(default_factory=dict)
    mends: bool = False


def _by_title(title: str) -> Fault:
    return next(row.fault for row in ROWS if row.title == title)


def _holder(scene: Scene) -> int:
    """Return the process that holds the port of the driven robot."""

    def look() -> int | None:
        for status in Path("/proc").glob("[0-9]*/status"):
            words = status.with_name("cmdline")
            try:
                parent = re.search(r"^PPid:\s+(\d+)", status.read_text(), re.MULTILINE)
                mine = parent is not None and int(parent[1]) == scene.pid(DRIVEN)
                if mine and b"hardware.holder" in words.read_bytes():
                    return int(status.parent.name)
            except OSError:  # it has ended meanwhile
                continue
        return None

    return until(look, "the holder")


def _all(sign: str) -> Callable[[Scene], None]:
    """Send a signal to all that runs on the robot's laptop."""

    def do(scene: Scene) -> None:
        for pid in (scene.run.pid, *map(scene.pid, (COMMANDER, DRIVEN))):
            send(pid, getattr(signal, sign))

    return do


def _signal_holder(sign: str) -> Callable[[Scene], None]:
    return lambda scene: send(_holder(scene), getattr(signal, sign))


NO_DEVICE = dict.fromkeys(SIMULATED, "it has no device")
NO_HOLDER = NO_DEVICE | dict.fromkeys(("dynabot", "remote"), "nobody holds its port")
#: what is left out, in five words
ELSEWHERE = {
    "gamepad": "hands have their own table",
    "keyboard": "hands have their own table",
    "terminal": "hands have their own table",
    "page": "hands have their own table",
    "browser": "hands have their own table",
    "gate": "it is the router's process",
    "the commander's Wi-Fi": "needs machines: table standstill",
    "the robot's Wi-Fi": "needs machines: table standstill",
    "a second robot of its name": "needs machines: tests/network",
}
SILENT: dict[str, Silence] = {
    "the commander": Silence(_by_title("the commander frozen"), "input/commander"),
    "its frozen host": Silence(_by_title("the robot's host frozen"), "robot/"),
    "its killed host": Silence(_by_title("the robot's host killed"), "robot/"),
    "its frozen holder": Silence(
        Fault(_signal_holder("SIGSTOP"), lambda scene: None),
        "robot/",
        NO_HOLDER,
        mends=True,
    ),
    "its killed holder": Silence(
        Fault(_signal_holder("SIGKILL"), lambda scene: None),
        "robot/",
        NO_HOLDER,
        mends=True,
    ),
    "its cable": Silence(
        Fault(lambda scene: scene.device.tell(f"unplug {LASTS}"), lambda scene: None),
        "robot/",
        NO_DEVICE,
    ),
    "the router": Silence(_by_title("the router frozen"), "router"),
    "the clock": Silence(_by_title("the clock frozen"), "clock|robot/"),
    "a closed lid": Silence(Fault(_all("SIGSTOP"), _all("SIGCONT")), "robot/|clock"),
}


@dataclass
class Answer:
    """What one trial showed.

    seconds: until the robot stood, infinite for one that drove on
    wrong: sentences on what was not as it has to be; none is well
    """

    seconds: float
    told: str
    wrong: list[str]


@dataclass
class Cell:
    """The trials of somebody's silence with a robot."""

    silent: str
    robot: str
    answers: list[Answer] = field(default_factory=list)

    def show(self) -> str:
        """Return the worst time; a robot that may drive on is told so."""
        silence = SILENT[self.silent]
        if why := silence.without.get(self.robot):
            return f"no: {why}"
        worst = max(answer.seconds for answer in self.answers)
        text = "drives on, and is called so" if worst == inf else f"{worst:.2f}"
        wrong = [sentence for answer in self.answers for sentence in answer.wrong]
        return f"**{text}: {wrong[0]}**" if wrong else f"{text} ({len(self.answers)})"


def has(silent: str, robot: str) -> bool:
    """Return whether there is such a cell."""
    return robot not in SILENT[silent].without


def measure(
    silences: Sequence[str],
    robots: Sequence[str],
    trials: int,
    folder: Path,
    tell: Callable[[str], None] = lambda line: None,
) -> list[Cell]:
    """Try each cell so many times, each in a run of its own."""
    found = [Cell(silent, robot) for silent in silences for robot in robots]
    for i, cell in enumerate(found):
        for n in range(trials if has(cell.silent, cell.robot) else 0):
            answer = once(cell.silent, cell.robot, folder / f"{i}-{n}")
            cell.answers.append(answer)
        tell(f"{cell.silent} | {cell.robot} | {cell.show()}")
    return found


def once(silent: str, robot: str, folder: Path) -> Answer:
    """Make one trial in a new run."""
    silence = SILENT[silent]
    scene: Scene
    if robot in SIMULATED:
        scene = SimulatedScene(Rig(folder), "same", robot=robot)
    elif robot == "remote":
        scene = Scene(Rig(folder), "same", robot="create2", commander="remote")
    else:
        scene = Scene(Rig(folder), "same", robot=robot)
    fabric = "away" if robot == "remote" else "rems"
    with scene:
        return _try(silence, scene, fabric)


def _try(silence: Silence, scene: Scene, fabric: str) -> Answer:
    scene.sleep(0.6)
    begun = time.monotonic()
    scene.begun = 0.0
    silence.fault.do(scene)
    begun = scene.begun or begun
    scene.sleep(max(0.0, begun + ASKED - time.monotonic()))
    wrong = []
    code, during = _stop(scene, fabric)
    asked = time.monotonic()
    scene.sleep(max(0.0, begun + LASTS - time.monotonic()))
    seconds, _ = scene.stood_still(0, begun, begun + LASTS)
    if silence.mends:
        stood = [c.at for c in scene.changes() if not c.moves and c.at >= begun]
        seconds = min(stood, default=inf) - begun
    wrong += _untrue(during, code, scene, asked)
    if seconds > LIMIT and "it may drive on" not in during:
        wrong.append(f"it drove for {seconds:.2f} s, and nobody says so")
    away = scene.away.text() if scene.commander == "remote" else ""
    screens = during + scene.run.text() + away
    if not re.search(silence.said, screens):
        wrong.append(f"no screen names {silence.said}")
    if silence.fault.undo is None:
        until(lambda: scene.run.ended is not None, "its end", BACK)
        if not re.search("driven-?0", scene.run.text()):
            wrong.append(f"its run ended without its name: {scene.run.text()[-400:]}")
        return Answer(seconds, during, wrong)
    silence.fault.undo(scene)
    wrong += _comes_back(scene, fabric)
    return Answer(seconds, during, wrong)


def _comes_back(scene: Scene, fabric: str) -> list[str]:
    """Yield what is wrong with STOP after the fault, and with driving on."""
    last = ""

    def stands() -> bool:
        nonlocal last
        code, last = _stop(scene, fabric)
        return code == 0

    try:
        until(stands, "a receipt that all stand", BACK)
        if scene.moving():
            return [f"it moves after {last!r}"]
        _rems(scene, "stop", "--release", "--fabric", fabric)
        scene.wait_until_moving(BACK)
    except (TimeoutError, RuntimeError) as error:
        return [f"it does not come back: {error} {last!r}"]
    return []


def _untrue(said: str, code: int, scene: Scene, asked: float) -> list[str]:
    """Return what is wrong with a receipt, such as one of a robot that moves."""
    name = "remote" if scene.commander == "remote" else "driven0"
    lines = [line for line in said.splitlines() if f"robot/{name}" in line]
    sure = [
        line
        for line in lines
        if " stands at tick " in line or line.endswith("by its own watchdog")
    ]
    moved = [
        change for change in scene.changes() if change.moves and change.at > asked
    ] or scene.moving()
    wrong = []
    if sure and moved:
        wrong.append(f"{sure[0]!r}, and it moves")
    if code == 0 and (moved or not sure):
        wrong.append(f"the exit status is 0 after {said!r}")
    return wrong


def _stop(scene: Scene, fabric: str) -> tuple[int, str]:
    return _rems(scene, "stop", "--fabric", fabric)


def _rems(scene: Scene, *words: str) -> tuple[int, str]:
    """Run a command on another person's laptop; its exit status, and what it says."""
    program = scene.rig.rems(*words, router=scene.endpoint)
    try:
        code = program.process.wait(20.0)
    except subprocess.TimeoutExpired:  # it repeats STOP until the router is back
        program.kill()
        code = 1
    program.end()
    scene.rig.programs.remove(program)  # it has ended, as it has to
    return code, program.text()


TEXT = f"""Somebody goes silent for {LASTS:g} s while a robot drives; {ASKED:g} s later
another person types `rems stop`. A cell has the seconds until the robot stood, in the
worst of the trials (their number). It is bold if one of these failed: (1) The robot
stands within {LIMIT:g} s, or is called one that may drive on. (2) No receipt calls it
standing while it moves, and the exit status is 0 only if all surely stand. (3) A screen
names the silent one. (4) After the fault STOP holds, with a true receipt; after its
release the robot drives again, or its run has ended with its name. Not tried here:"""


def section(found: Sequence[Cell]) -> Section:
    """Return the table for the page."""
    robots = list(dict.fromkeys(cell.robot for cell in found))
    rows: dict[str, list[str]] = {}
    for cell in found:
        rows.setdefault(cell.silent, []).append(cell.show())
    lines = table(["silent", *robots], [[name, *cells] for name, cells in rows.items()])
    left = ELSEWHERE | {f"`{n}`": d[4:] for n, d in DRIVERS.items() if d[:4] == "no: "}
    text = "\n".join([TEXT, "", *(f"- {name}: {why}." for name, why in left.items())])
    return Section("crossings", "Silent programs and machines, by robot", text, lines)
