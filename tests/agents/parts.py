"""Small agents that the tests run: a cart, things that drive it, things that fail."""

from __future__ import annotations

import ctypes
import math
import os
import random
import signal
import sys
import threading
from pathlib import Path
from typing import Any

from rems_net import (
    Definition,
    Driver,
    In,
    Input,
    Out,
    Output,
    Process,
    Schema,
    Settings,
    Tick,
    verb,
)
from rems_net.defdict import (
    DefDict,
    angle,
    angular_velocity,
    boolean,
    integer,
    length,
    number,
    percent,
    text,
    velocity,
)
from rems_net.outputs.csv import CsvOutput

STATE = Schema(
    "cart.state", {"x": length("m"), "y": length("m"), "heading": angle("rad")}
)
COMMAND = Schema(
    "cart.command",
    {
        "speed": velocity("m/s", range=(-1, 1)),
        "turn": angular_velocity("rad/s", range=(-2, 2)),
    },
)
PERCENT = Schema("stick", {"speed": percent(), "turn": percent()})


class Cart(Definition):
    command = In(COMMAND)
    state = Out(STATE)


class Euler(Driver):
    """Steps the cart; can be told to misbehave at a tick."""

    options = Settings(
        raise_at=integer(default=0),
        kill_at=integer(default=0),
        stall_at=integer(default=0),
        stall=number(default=0.0),
    )

    def drive(self, command: DefDict, dt: float) -> None:
        n = self.tick.n
        if n == self.options.raise_at:
            raise ZeroDivisionError("wheels fell off")
        if n == self.options.kill_at:
            os.kill(os.getpid(), signal.SIGTERM)
            threading.Event().wait(10)
        if n == self.options.stall_at:
            threading.Event().wait(self.options.stall)
        s = self.state
        s.x += dt * command.speed * math.cos(s.heading)
        s.y += dt * command.speed * math.sin(s.heading)
        s.heading += dt * command.turn

    def sense(self) -> None:
        pass


class FreeEuler(Euler):
    """Never waited for, as what is really driven."""

    lockstep = False


class Gripping(Euler):
    """A cart with a hand."""

    @verb
    def grip(self, width: float, firmly: bool = False) -> dict[str, object]:
        if width < 0:
            raise ValueError("no hand is that small")
        return {"width": width, "firmly": firmly}


class Wave(Input):
    value = Out(PERCENT)

    def read(self, tick: Tick) -> dict[str, float]:
        return {"speed": 50.0, "turn": 100 * math.sin(tick.t)}


class TooFast(Input):
    """Says what no cart may do, from tick 5 on."""

    value = Out(Schema("fast", {"speed": velocity("m/s"), "turn": angular_velocity()}))

    def read(self, tick: Tick) -> dict[str, float]:
        return {"speed": 5.0 if tick.n >= 5 else 0.5, "turn": 0.0}


class Follow(Process):
    """Turns towards where the leader was."""

    leader = In(STATE)
    me = In(STATE)
    command = Out(COMMAND)

    def step(self, tick: Tick) -> None:
        dx, dy = self.leader.x - self.me.x, self.leader.y - self.me.y
        error = math.atan2(dy, dx) - self.me.heading
        error = math.atan2(math.sin(error), math.cos(error))
        speed, turn = min(1.0, math.hypot(dx, dy)), max(-2.0, min(2.0, error))
        self.command = {"speed": speed, "turn": turn}


class Log(Output):
    """Writes what every robot had, tick by tick, as text."""

    robots = In(source="robot/*/*")

    def open(self) -> None:
        self.path = self.out / f"{self.name}.txt"
        self.file = self.path.open("w", encoding="utf-8", newline="\n")

    def write(self, tick: Tick) -> None:
        for key, value in self.robots.items():
            words = " ".join(repr(float(v)) for v in value.to_array())
            print(tick.n, key, words, file=self.file, flush=True)

    def close(self) -> None:
        if hasattr(self, "file"):
            self.file.close()

    def made(self) -> list[Path]:
        return [self.path]


class Wheels(Input):
    """Two wheels, each a wave."""

    options = Settings(phase=number(default=0.0))
    value = Out(Schema("wheels", {"wheel": {"left": percent(), "right": percent()}}))

    def read(self, tick: Tick) -> dict[str, float]:
        at = tick.t + self.options.phase
        return {"wheel/left": 80 * math.sin(at), "wheel/right": 90 * math.cos(2 * at)}


class Sleepy:
    """Mixed into an agent: before a step it sleeps at random, if PARTS_SLEEP says so.

    PARTS_SLEEP is the longest time, in seconds; PARTS_STALL is `<agent>@<tick>@<s>`.
    """

    def begin(self, tick: Tick) -> None:
        wait = threading.Event().wait
        if longest := float(os.environ.get("PARTS_SLEEP", 0)):
            wait(random.uniform(0, longest))
        if stall := os.environ.get("PARTS_STALL"):
            name, n, seconds = stall.split("@")
            if name == self.name and tick.n == int(n):  # type: ignore[attr-defined]
                wait(float(seconds))
        super().begin(tick)  # type: ignore[misc]


class SleepyWave(Sleepy, Wave):
    pass


class SleepyEuler(Sleepy, Euler):
    pass


class SleepyFollow(Sleepy, Follow):
    pass


class SleepyLog(Sleepy, Log):
    pass


class SleepyCsv(Sleepy, CsvOutput):
    pass


COUNT = Schema("count", {"n": integer(), "at": integer(), "dt": number()})


class Count(Input):
    """Says its tick."""

    value = Out(COUNT)

    def read(self, tick: Tick) -> dict[str, object]:
        return {"n": tick.n, "at": tick.n, "dt": tick.dt}


class Pass(Process):
    """Says what it heard, and when."""

    heard_from = In(COUNT)
    value = Out(COUNT)

    def step(self, tick: Tick) -> None:
        self.value = {"n": self.heard_from["n"] + 0, "at": tick.n, "dt": tick.dt}


class Add(Process):
    """Says one more than it heard."""

    heard_from = In(COUNT)
    value = Out(COUNT)

    def step(self, tick: Tick) -> None:
        self.value = {"n": self.heard_from["n"] + 1, "at": tick.n, "dt": tick.dt}


class Slow(Pass):
    """Free-running, and slower than the ticks."""

    lockstep = False

    def step(self, tick: Tick) -> None:
        threading.Event().wait(0.05)
        super().step(tick)


class Counts(Output):
    """Writes `tick t port n at dt` for everything that counts."""

    inputs = In(source="input/*/*")
    processes = In(source="process/*/*")

    def open(self) -> None:
        self.file = (self.out / "counts.txt").open("w", encoding="utf-8")

    def write(self, tick: Tick) -> None:
        for key, value in {**self.inputs, **self.processes}.items():
            name = key.split("/")[1]
            words = [tick.n, repr(tick.t), name, *value.values()]
            print(*words, file=self.file, flush=True)

    def close(self) -> None:
        self.file.close()


class Spin(Count):
    """Never returns from tick 5."""

    def read(self, tick: Tick) -> dict[str, object]:
        while tick.n >= 5:
            pass
        return super().read(tick)


class Bad(Input):
    """Misbehaves at tick 5, in the way it is told."""

    options = Settings(how=text(default=""))
    value = Out(Schema("bad", {"x": length("m"), "name": text()}))

    def open(self) -> None:
        if self.options.how == "open":
            raise OSError("the stick is not plugged in")
        if self.options.how == "die early":
            os.kill(os.getpid(), signal.SIGKILL)

    def read(self, tick: Tick) -> Any:
        if tick.n != 5:
            return {"x": 0.1, "name": "fine"}
        match self.options.how:
            case "list":
                return [1.0, 2.0]
            case "number":
                return 7
            case "unknown field":
                return {"nmae": "x"}
            case "nan":
                return {"x": float("nan")}
            case "text for a number":
                return {"x": "far"}
            case "second":
                return {"x": "2 s"}
            case "exit":
                sys.exit(3)
            case "os._exit":
                os._exit(7)
            case "segfault":
                ctypes.string_at(0)
            case "recursion":
                return self.read(tick)
            case "job":
                self.jobs.submit(math.sqrt, -1.0)
        return None

    def close(self) -> None:
        if self.options.how == "close":
            raise OSError("the stick is stuck")


class Constructed(Input):
    """Can be made by who starts the experiment, but not in its own process."""

    value = Out(COUNT)

    def __init__(self, *args: Any, **settings: Any):
        super().__init__(*args, **settings)
        if os.environ.get("PARTS_PARENT") != str(os.getpid()):
            raise ValueError("no two sticks are alike")

    def read(self, tick: Tick) -> None:
        raise AssertionError("it is never made")


class Full(CsvOutput):
    """Its disk is full after some kilobytes."""

    def open(self) -> None:
        import resource

        resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))
        super().open()


class Noting(Input):
    """Submits a job and notes what comes of it."""

    options = Settings(what=text(default="square"), process=boolean(default=False))
    value = Out(COUNT)

    def open(self) -> None:
        self.at = 0
        self.thread = threading.get_ident()

    def read(self, tick: Tick) -> dict[str, object]:
        if tick.n == 3:
            process = bool(self.options.process)
            match self.options.what:
                case "square":
                    self.jobs.submit(square, 12, then=self.note, process=process)
                case "long":
                    self.jobs.submit(pause, 2.0, then=self.note, process=process)
                case "endless":
                    self.jobs.submit(pause, 1000.0, then=self.note, process=process)
                case "busy":
                    for _ in range(4):
                        self.jobs.submit(pause, 1000.0, process=process)
                case "fails":
                    self.jobs.submit(fail, 3, failed=self.failed, process=process)
                case "raises":
                    self.jobs.submit(fail, 3, process=process)
                case "dies":
                    self.jobs.submit(die, failed=self.failed, process=process)
                case "lambda":
                    self.jobs.submit(lambda: 3, then=self.note, process=process)
                case "called":
                    self.jobs.submit(square(3), then=self.note, process=process)  # type: ignore[arg-type]
        return {"n": tick.n, "at": self.at, "dt": tick.dt}

    def note(self, result: object) -> None:
        same = threading.get_ident() == self.thread
        print(f"job gave {result}, in the agent's thread: {same}", flush=True)
        self.at = self.tick.n

    def failed(self, error: Exception) -> None:
        print(f"job failed: {type(error).__name__}: {error}", flush=True)
        self.at = self.tick.n


def square(x: int) -> int:
    return x * x


def pause(seconds: float) -> str:
    threading.Event().wait(seconds)
    return "rested"


def fail(x: int) -> None:
    raise LookupError(f"{x} is not there")


def die() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


class Steady(Input):
    """Drives a curve."""

    value = Out(COMMAND)

    def read(self, tick: Tick) -> dict[str, float]:
        return {"speed": 0.5 + 0.3 * math.sin(tick.t), "turn": math.cos(3 * tick.t)}
