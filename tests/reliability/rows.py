"""The faults after which a driven robot has to stand still, and how each is made."""

import signal
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from tests.reliability.rig.programs import send
from tests.reliability.scene import PLACES, Scene

#: seconds for which a command may be old, and what the fabric may take on top
MAX_AGE, MARGIN = 0.5, 0.1
LIMIT = MAX_AGE + MARGIN


@dataclass(frozen=True)
class Fault:
    """What `do` brings about at once, and `undo` ends, if it ends."""

    do: Callable[[Scene], None]
    undo: Callable[[Scene], None] | None = None


@dataclass(frozen=True)
class Row:
    """A fault, and what is watched while it `lasts` [s]."""

    title: str
    fault: Fault
    lasts: float = 3.0
    places: Sequence[str] = PLACES
    commander: str = "lock-step"
    #: seconds after which it must stand
    limit: float = LIMIT


def _signal(agent: str, name: str) -> Callable[[Scene], None]:
    return lambda scene: send(scene.pid(agent), getattr(signal, name))


def _killed(agent: str) -> Fault:
    return Fault(_signal(agent, "SIGKILL"))


def _frozen(agent: str) -> Fault:
    return Fault(_signal(agent, "SIGSTOP"), _signal(agent, "SIGCONT"))


def _router_back(scene: Scene) -> None:
    scene.router, _ = scene.rig.router(scene.hub, scene.endpoint)


def _late(way: Fault) -> Fault:
    """Words that were said while the way was shut, and come when they are 2 s old.

    The commander is frozen meanwhile, so nothing newer comes. What begins is that the
    way is open again: a robot that moves then obeys what is too old.
    """

    def do(scene: Scene) -> None:
        assert way.undo is not None
        way.do(scene)
        scene.sleep(1.0)
        send(scene.pid(COMMANDER), signal.SIGSTOP)
        scene.sleep(2.0)
        scene.begun = time.monotonic()
        way.undo(scene)

    return Fault(do, _signal(COMMANDER, "SIGCONT"))


def _hold(scene: Scene) -> None:
    (scene.out / "hold").touch()


def _go_on(scene: Scene) -> None:
    (scene.out / "hold").unlink()


def _debugged(scene: Scene) -> None:
    scene.debugger = scene.tell(
        "tests.reliability.programs.debugger", str(scene.pid(DRIVEN))
    )
    scene.debugger.wait_for("ready")
    scene.begun = float(scene.debugger.ask("stop"))


def _cut(which: str) -> Fault:
    return Fault(lambda s: s.rig.cut(getattr(s, which)), lambda s: s.rig.heal())


def _cut_one_way(scene: Scene) -> None:
    scene.rig.cut(scene.hub, scene.bot, one_way=True)


def _stopped(fabric: str) -> Fault:
    return Fault(
        lambda scene: scene.clock("stop", fabric),
        lambda scene: scene.clock("release", fabric),
    )


APART, ROUTED = ("apart",), ("same", "apart")
COMMANDER, OTHER, DRIVEN = "input/commander", "robot/other", "robot/driven0"
ROUTER_FROZEN = Fault(lambda s: s.router.freeze(), lambda s: s.router.thaw())
#: faults of a run elsewhere, whose robot is this one by `driver = "remote"`
REMOTE = (
    ("its robot frozen", _frozen("robot/remote")),
    ("its robot killed", _killed("robot/remote")),
    ("its input frozen", _frozen(COMMANDER)),
    ("its clock frozen", Fault(lambda s: s.away.freeze(), lambda s: s.away.thaw())),
    ("its clock killed", Fault(lambda s: s.away.kill())),
    ("STOP there", _stopped("away")),
    ("STOP here", _stopped("rems")),
)
ROWS = [
    Row("the commander frozen", _frozen(COMMANDER)),
    Row("the commander killed", _killed(COMMANDER)),
    Row("the commander cut off", _cut("desk"), places=APART),
    Row(
        "a free-running commander frozen, ticks go on",
        _frozen(COMMANDER),
        commander="free-running",
    ),
    Row(
        "the same, and a process says its words again",
        _frozen(COMMANDER),
        commander="relayed",
    ),
    Row(
        "a program outside, that commands, frozen",
        Fault(lambda s: s.outsider.freeze(), lambda s: s.outsider.thaw()),
        commander="outside",
    ),
    Row(
        "a program outside, that commands, killed",
        Fault(lambda s: s.outsider.kill()),
        commander="outside",
    ),
    *(
        Row(f"a run elsewhere that commands: {what}", f, commander="remote")
        for what, f in REMOTE
    ),
    Row(
        "a run elsewhere that commands: cut off",
        _cut("desk"),
        places=APART,
        commander="remote",
    ),
    Row("another lock-step robot frozen", _frozen(OTHER)),
    Row("a tick held by a robot's code", Fault(_hold, _go_on)),
    Row(
        "the clock paused",
        Fault(lambda s: s.clock("pause"), lambda s: s.clock("resume")),
    ),
    Row("the clock frozen", Fault(lambda s: s.run.freeze(), lambda s: s.run.thaw())),
    Row("the clock killed", Fault(lambda s: s.run.kill())),
    Row("the router frozen", ROUTER_FROZEN, places=ROUTED),
    Row("the router killed", Fault(lambda s: s.router.kill()), places=ROUTED),
    Row(
        "the router restarted after 2 s",
        Fault(lambda s: s.router.kill(), _router_back),
        lasts=2.0,
        places=ROUTED,
    ),
    Row("the network cut for 8 s", _cut("hub"), lasts=8.0, places=APART),
    Row("the robot's machine cut for 30 s", _cut("bot"), lasts=30.0, places=APART),
    Row(
        "the way to the robot's machine cut",
        Fault(_cut_one_way, lambda s: s.rig.heal()),
        places=APART,
    ),
    Row(
        "words come 2 s late: the router was frozen",
        _late(ROUTER_FROZEN),
        places=ROUTED,
        commander="free-running",
        limit=0.0,
    ),
    Row(
        "words come 2 s late: the robot's machine was cut off",
        _late(_cut("bot")),
        places=APART,
        commander="free-running",
        limit=0.0,
    ),
    Row("the robot's host frozen", _frozen(DRIVEN)),
    Row("the robot's host killed", _killed(DRIVEN)),
    Row(
        "the robot's host stopped by a debugger",
        Fault(_debugged, lambda s: s.debugger.kill()),
    ),
]
