"""Small agents that the tests run: a cart, things that drive it, things that fail."""

import math
import os
import random
import signal
import threading
from pathlib import Path

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
from rems_net.agents.runtime import runtime
from rems_net.defdict import (
    DefDict,
    angle,
    angular_velocity,
    integer,
    length,
    number,
    percent,
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
        n = runtime(self).tick.n
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

    PARTS_SLEEP is the longest time, in seconds; PARTS_STALL has `<agent>@<tick>@<s>`
    for each stall.
    """

    def step(self, tick: Tick) -> None:
        wait = threading.Event().wait
        if longest := float(os.environ.get("PARTS_SLEEP", 0)):
            wait(random.uniform(0, longest))
        for stall in os.environ.get("PARTS_STALL", "").split():
            name, n, seconds = stall.split("@")
            if name == self.name and tick.n == int(n):  # type: ignore[attr-defined]
                wait(float(seconds))
        super().step(tick)  # type: ignore[misc]


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


class Steady(Input):
    """Drives a curve."""

    value = Out(COMMAND)

    def read(self, tick: Tick) -> dict[str, float]:
        return {"speed": 0.5 + 0.3 * math.sin(tick.t), "turn": math.cos(3 * tick.t)}
