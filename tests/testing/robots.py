"""A cart, a good driver of it, and wrong ones of every kind: `# wrong` marks the line.

Each says in its docstring which check finds it, and a part of what that says.
"""

import math
import os
import random
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, ClassVar

from rems_net import Definition, Driver, In, Out, Schema, Settings, Tick
from rems_net.agents.robot import Robot
from rems_net.agents.runtime import runtime
from rems_net.defdict import DefDict, angle, angular_velocity, length, number, velocity
from rems_net.drivers.hardware.driven import Driven

#: ends what wrong robots leave running
over = threading.Event()


class Cart(Definition):
    """A cart that sees how far it is from a wall."""

    command = In(
        Schema(
            "cart.command",
            {
                "speed": velocity(range=(-1, 1)),
                "turn": angular_velocity(range=(-2, 2)),
            },
        )
    )
    state = Out(
        Schema("cart.state", {"x": length(), "y": length(), "heading": angle()})
    )
    sensors = Out(Schema("cart.sensors", {"range": length()}))

    def derivative(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        return {
            "x": command["speed"] * math.cos(state["heading"]),
            "y": command["speed"] * math.sin(state["heading"]),
            "heading": command["turn"],
        }

    def measure(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        return {"range": 5.0 - state["x"]}


class Good(Driver):
    """Euler's steps."""

    options = Settings(slip=number(default=0.0))

    def drive(self, command: DefDict, dt: float) -> None:
        for path, rate in self.rates(command).items():
            self.state[path] += (1 - self.options.slip) * rate * dt

    def rates(self, command: DefDict) -> dict[str, float]:
        found: dict[str, float] = Cart.derivative(self, self.state, command)  # type: ignore[arg-type]
        return found

    def sense(self) -> None:
        self.sensors = {"range": 5.0 - self.state.x}


# -- built ---------------------------------------------------------------------------


class NoDrive(Driver):
    """drives: NoDrive has no drive(self, command, dt)"""

    def drve(self, command: DefDict, dt: float) -> None: ...

    def sense(self) -> None: ...


class Immortal(Good):
    """built: max_age = inf"""

    max_age = math.inf


class Eager(Good):
    """built: they begin a thread"""

    def __init__(self, name: str = "", **rest: Any):  # wrong
        super().__init__(name, **rest)
        threading.Thread(target=over.wait, name="a thread", daemon=True).start()


class Forgetful(Good):
    """built: does not call super().prepare()"""

    def prepare(self) -> None:  # wrong
        self.ready = True


# -- opens ---------------------------------------------------------------------------


class NoDevice(Good):
    """opens: FileNotFoundError"""

    def open(self) -> None:
        Path("/no/such/device").read_bytes()  # wrong


class AtHome(Good):
    """resets: state x = 0.0"""

    def open(self) -> None:  # wrong
        self.state = {"x": 0.0, "y": 0.0, "heading": 0.0}


# -- drives --------------------------------------------------------------------------


class Still(Good):
    """drives: nothing in the state changes"""

    def drive(self, command: DefDict, dt: float) -> None:  # wrong
        pass


class Breaks(Good):
    """drives: ZeroDivisionError:"""

    def drive(self, command: DefDict, dt: float) -> None:
        self.state.x += dt / (0 * command.speed)  # wrong


class Unfit(Good):
    """drives: but got nan"""

    def drive(self, command: DefDict, dt: float) -> None:
        self.state.x = math.nan  # wrong


class Hasty(Good):
    """drives: x changes by"""

    def drive(self, command: DefDict, dt: float) -> None:  # wrong
        self.state.x += 0.1 * command.speed


class Meddler(Good):
    """drives: its command was speed = 0.5, and it took 0.25"""

    def drive(self, command: DefDict, dt: float) -> None:  # wrong
        command.speed = command.speed / 2
        super().drive(command, dt)


# -- senses --------------------------------------------------------------------------


class Drifts(Good):
    """senses: when it is asked again"""

    speed = 0.0

    def drive(self, command: DefDict, dt: float) -> None:
        self.speed = command.speed * dt

    def sense(self) -> None:  # wrong
        self.state.x += self.speed


class Typo(Good):
    """drives: no field 'ranj'"""

    def sense(self) -> None:
        self.sensors = {"ranj": 1.0}  # wrong


# -- resets --------------------------------------------------------------------------


class Remembers(Good):
    """resets: reset() leaves self.gone"""

    gone = 0.0

    def open(self) -> None:
        self.gone = 0.0

    def drive(self, command: DefDict, dt: float) -> None:
        self.gone += abs(command.speed) * dt  # wrong
        self.state.x += command.speed * dt * (1 - 0.1 * self.gone)
        self.state.heading += command.turn * dt


class Stays(Good):
    """resets: reset() to bring the state back"""

    def rewind(self) -> None:  # wrong
        if "state" not in self.__dict__ or not runtime(self).tick.n:
            super().rewind()


# -- stops ---------------------------------------------------------------------------


class RollsOn(Good):
    """stops: x goes on by"""

    def rewind(self) -> None:
        super().rewind()
        self.speed = 0.0

    def drive(self, command: DefDict, dt: float) -> None:  # wrong
        self.speed = command.speed or self.speed
        self.state.x += self.speed * dt
        self.state.heading += command.turn * dt


class OwnStep(Good):
    """stops: it obeys speed"""

    def step(self, tick: Tick) -> None:  # wrong
        self.drive(self.command, tick.dt)
        self.sense()


# -- refuses -------------------------------------------------------------------------


class Swallows(Good):
    """refuses: it was taken without an error"""

    def __init__(self, name: str = "", **rest: Any):  # wrong
        rest.pop("options", None)
        super().__init__(name, **rest)


# -- closes --------------------------------------------------------------------------


class Runs(Good):
    """closes: a thread, for ever"""

    def open(self) -> None:  # wrong
        threading.Thread(target=over.wait, name="for ever", daemon=True).start()


class Leaks(Good):
    """closes: a file"""

    def open(self) -> None:  # wrong
        self.file = Path(__file__).open(encoding="utf-8")  # noqa: SIM115


class CloseOnce(Good):
    """closes: AttributeError"""

    def open(self) -> None:
        self.file = Path(__file__).open(encoding="utf-8")  # noqa: SIM115

    def close(self) -> None:
        self.file.close()  # wrong
        del self.file


# -- again, and shares ---------------------------------------------------------------


class Noisy(Good):
    """resets: , and was"""

    def drive(self, command: DefDict, dt: float) -> None:
        super().drive(command, dt)
        self.state.x += random.gauss(0.0, 1e-6)  # wrong


class Hurried(Good):
    """resets: , and was"""

    then = 0.0

    def drive(self, command: DefDict, dt: float) -> None:
        now = time.perf_counter()  # wrong
        self.state.x += command.speed * (dt + 1e-3 * math.sin(1e6 * now))
        self.state.heading += command.turn * dt


class Crowd(Good):
    """again: differs by"""

    trips: ClassVar[list[int]] = []

    def open(self) -> None:
        self.trips.append(1)

    def drive(self, command: DefDict, dt: float) -> None:
        super().drive(command, dt * (1 + 1e-3 * len(self.trips)))


class Twins(Good):
    """shares: one was driven"""

    at: ClassVar[dict[str, float]] = {}

    def rewind(self) -> None:
        super().rewind()
        self.at.update(self.state.flat())

    def drive(self, command: DefDict, dt: float) -> None:
        for path, rate in self.rates(command).items():
            self.at[path] += rate * dt
        self.state = dict(self.at)

    def sense(self) -> None:
        super().sense()
        self.state = dict(self.at)


class Herd(Good):
    """shares: swarm() to do what step() does"""

    @classmethod  # wrong
    def swarm(cls, robots: Sequence[Robot]) -> Callable[[Tick], None]:
        def step(tick: Tick) -> None:
            for robot in robots:
                robot.drive(robot.command, 1.01 * tick.dt)
                robot.sense()

        return step


# -- agrees --------------------------------------------------------------------------


class Backwards(Good):
    """agrees: commanded"""

    def drive(self, command: DefDict, dt: float) -> None:  # wrong
        self.state.x += command.speed * math.cos(self.state.heading) * dt
        self.state.y += command.speed * math.sin(self.state.heading) * dt
        self.state.heading -= command.turn * dt


class Degrees(Good):
    """agrees: heading"""

    def drive(self, command: DefDict, dt: float) -> None:  # wrong
        super().drive(command, dt)
        self.state.heading += (180 / math.pi - 1) * command.turn * dt


# -- processes -----------------------------------------------------------------------


class Local(Good):
    """processes: is in one, and"""

    def drive(self, command: DefDict, dt: float) -> None:  # wrong
        super().drive(command, dt)
        self.state.x += 1e-12 * os.getpid()


# -- in wall time --------------------------------------------------------------------


class Unwatched(Good):
    """stops: no device thread"""

    lockstep = False


class Wheels(Driven):
    """A device in this process, that rolls for as long as it was told to."""

    x = speed = 0.0
    then = 0.0

    def connect(self) -> None:
        self.x, self.speed, self.then = 0.0, 0.0, time.monotonic()

    def exchange(self, command: DefDict) -> Any:
        now = time.monotonic()
        self.x += self.speed * (now - self.then)
        self.then, self.speed = now, self.obeyed(command)
        return {"state": {"x": self.x}}

    def obeyed(self, command: DefDict) -> float:
        return float(command.speed)


class Coasts(Wheels):
    """stops: x goes on by"""

    def obeyed(self, command: DefDict) -> float:
        return float(command.speed or self.speed)


WRONG: tuple[type[Driver], ...] = (
    *(NoDrive, Immortal, Eager, Forgetful, NoDevice, AtHome),
    *(Still, Breaks, Unfit, Hasty, Meddler, Drifts, Typo, Remembers, Stays),
    *(RollsOn, OwnStep, Swallows, Runs, Leaks, CloseOnce, Noisy, Hurried),
    *(Crowd, Twins, Herd, Backwards, Degrees),
)
