"""Agent: a part of an experiment. It steps at each tick and never reads a clock."""

from collections.abc import Iterable, Mapping
from functools import cache, cached_property
from math import sqrt, tau
from pathlib import Path
from random import Random
from typing import Any, ClassVar

from rems_net.agents.background.jobs import Jobs
from rems_net.agents.diagnosis import lacking, written
from rems_net.agents.ports import In, Out, Port, Settings
from rems_net.agents.runtime import RUNTIME, Runtime, runtime
from rems_net.agents.tick import Tick
from rems_net.defdict import DefDict, Field, Schema
from rems_net.errors import SchemaError, nearest
from rems_net.maths import cos, log, sin

PHASES = ("input", "robot", "world", "process", "output")


class Seeded(Random):
    """Random numbers that come from a seed alone."""

    gauss_next: float | None

    def seed(self, a: Any = None, version: int = 2) -> None:
        """Begin again from the seed `a`. Raises SchemaError without one."""
        if a is None:
            raise SchemaError(
                "self.random.seed() without a seed would take one of the system, and "
                "no run could be repeated; leave the line out, since the experiment's "
                "seed is set already, or write such as self.random.seed(1). (R0511)"
            )
        super().seed(a, version)

    def gauss(self, mu: float = 0.0, sigma: float = 1.0) -> float:
        """Return a number of a normal distribution, with equal bits on every system.

        It is that of `random.Random`, whose logarithm and sine are the C library's.
        """
        deviate, self.gauss_next = self.gauss_next, None
        if deviate is None:
            angle = tau * self.random()
            radius = sqrt(-2.0 * log(1.0 - self.random()))
            deviate, self.gauss_next = cos(angle) * radius, sin(angle) * radius
        return float(mu + deviate * sigma)


class Agent:
    """Base of inputs, robots, processes and outputs.

    The constructor stores; `prepare()` checks and settles the ports; `open()`
    acquires; `step()` runs once per tick; `close()` always runs. An agent is built
    from plain data (a name and settings), in the process where it lives.
    """

    kind: ClassVar[str]
    options = Settings()
    #: False for hardware: the clock never waits for it.
    lockstep: ClassVar[bool] = True
    #: Names of optional libraries that it needs; `rems show` lists the missing ones.
    needs: ClassVar[tuple[str, ...]] = ()
    #: Names of settings that `adjust` may change while it runs: it reads them anew at
    #: each step. With such names `adjust` is a verb.
    adjustable: ClassVar[tuple[str, ...]] = ()
    #: Whether it makes pictures, or values of them: they are not the same bytes on two
    #: machines, so a rerun plays its recording.
    by_picture: ClassVar[bool] = False
    _found: ClassVar[dict[str, Port]]

    def __init__(
        self,
        name: str = "",
        *,
        options: Mapping[str, Any] | None = None,
        folder: Path | None = None,
        out: Path | None = None,
        every: int = 1,
    ):
        self.name = name
        self.folder = folder or Path()
        self.out = out or Path()
        self.__dict__[RUNTIME] = Runtime(
            self.key, tuple(self.ins()), every, self.lockstep
        )
        self._fill("options", options)

    def _fill(self, slot: str, values: Mapping[str, Any] | None) -> None:
        settings: Settings = getattr(type(self), slot)
        self.__dict__[slot] = settings.schema(values or {})

    @property
    def key(self) -> str:
        """Its key without the fabric: `robot/sim`."""
        return f"{self.kind}/{self.name}"

    @property
    def tick(self) -> Tick:
        """The newest tick at which it stepped, or steps now."""
        return runtime(self).tick

    @property
    def jobs(self) -> Jobs:
        """Work that takes longer than a tick."""
        return runtime(self).jobs

    @property
    def restarts(self) -> int:
        """How often its process was started again after a crash.

        Each process begins in the initial state; what was recorded before is kept.
        """
        return runtime(self).restarts

    @cached_property
    def random(self) -> Random:
        """Its own random numbers: the same in every run with the experiment's seed.

        They come from the seed and its key alone, wherever it runs. For numpy:
        `numpy.random.default_rng(self.random.getrandbits(64))`, once, in `open`.
        """
        return Seeded(f"{runtime(self).seed} {self.key}")

    @classmethod
    def ports(cls) -> dict[str, Port]:
        """Return all ports by name, base classes first, in the order of definition."""
        return cls._all_ports().copy()

    @classmethod
    def ins(cls) -> dict[str, In]:
        return {k: v for k, v in cls._all_ports().items() if isinstance(v, In)}

    @classmethod
    def outs(cls) -> dict[str, Out]:
        """Return the Outs that it sets itself."""
        outs = cls._all_ports().items()
        return {k: v for k, v in outs if isinstance(v, Out) and v.marks}

    @classmethod
    @cache
    def _own_outs(cls) -> tuple[str, ...]:
        return tuple(cls.outs())

    @classmethod
    def _all_ports(cls) -> dict[str, Port]:
        """Return all ports. They are searched once per class: a crowd asks often."""
        if "_found" not in vars(cls):
            found: dict[str, Port] = {}
            for base in reversed(cls.__mro__):
                slots = vars(base).items()
                found.update((k, v) for k, v in slots if isinstance(v, Port))
            cls._found = found
        return cls._found

    def schemas(self) -> dict[str, Schema]:
        """Return the schema of each port that has its own, by port name."""
        return {k: self.__dict__[k].schema for k in self.ports() if k in self.__dict__}

    def published(self) -> dict[str, Schema]:
        """Return the schema of each port that this agent publishes."""
        outs = [k for k, v in self._all_ports().items() if isinstance(v, Out)]
        return {k: self.__dict__[k].schema for k in outs if k in self.__dict__}

    def adjust(self, **values: Any) -> None:
        """Change settings that are `adjustable`: all of these, or none.

        The values are checked like any others, units included: `adjust(gain=0.5)`.
        Raises SchemaError for a setting that is not adjustable.
        """
        can = [name for name, _, row in self.all_settings() if row["adjustable"]]
        for name in values:
            if name not in can:
                raise SchemaError(
                    f"{name!r} of {self.key} cannot be changed while it runs; these "
                    f"can: {', '.join(can) or 'none'}.{nearest(name, can)} (R0513)"
                )
        given = {
            slot: {k: v for k, v in values.items() if k in self.__dict__[slot]}
            for slot in self._slots()
        }
        for slot, part in given.items():
            self.__dict__[slot].copy().update(part)
        for slot, part in given.items():
            self.__dict__[slot].update(part)

    def _slots(self) -> list[str]:
        return [slot for slot in ("parameters", "options") if slot in self.__dict__]

    def all_settings(self) -> Iterable[tuple[str, Field, dict[str, Any]]]:
        """Yield each setting: name, field, and a row of value, unit and adjustable."""
        parts = (vars(part).get("adjustable", ()) for part in type(self).__mro__)
        names = {name for part in parts for name in part}
        for slot in self._slots():
            found = self.__dict__[slot].describe()
            for name, field in self.__dict__[slot].schema.rows():
                yield name, field, found[name] | {"adjustable": name in names}

    def prepare(self) -> None:
        """Check what can be checked before anything starts, and settle the ports.

        Runs in the process that starts the experiment (so that a mistake is reported
        before anything runs) and again in the agent's own process. May read files; must
        not acquire anything. Call `self.settle(port, schema)` for a port whose schema
        is found here.
        """
        for name, port in self.ports().items():
            schema = port.schema_for(self._parameters())
            if schema is not None:
                self.settle(name, schema)

    def doubts(self, agents: "Mapping[str, Agent]") -> Iterable[str]:
        """Return warnings of odd settings, before the start.

        agents: all of the experiment, by key.
        """
        return ()

    def _parameters(self) -> DefDict:
        return self.options

    def settle(self, port: str, schema: Schema) -> None:
        """Give a port its schema, and a live value with the defaults."""
        self.__dict__[port] = schema()

    def open(self) -> None:
        """Acquire what stepping needs: devices, files, simulators."""

    def step(self, tick: Tick) -> None:
        """Do one step: read the Ins, set the Outs.

        `tick.t` [s] is the end of the step.
        """

    def close(self) -> None:
        """Give back what `open` acquired. Runs once, also after an error."""


class Input(Agent):
    """An input: commands from a file, a keyboard, a program. Write `read`."""

    kind = "input"
    #: whether a person moves it: it needs a run with a pace
    by_hand: ClassVar[bool] = False

    @property
    def end(self) -> float | None:
        """Fabric time [s] after which it sends nothing more; None for never."""
        return None

    def foreseen(self) -> Iterable[tuple[int, Mapping[str, Any]]]:
        """Return the commands that are known before the start, for a check.

        Each is a pair: its line in `file()`, and its values.
        """
        return ()

    def file(self) -> Path | None:
        """Return the file that it plays."""
        return None

    def read(self, tick: Tick) -> Mapping[str, Any] | None:
        """Return the values of this tick (or set an Out and return None)."""
        raise lacking(type(self), self.kind, "read(self, tick)")

    def step(self, tick: Tick) -> None:
        values = self.read(tick)
        if values is not None:
            outs = self._own_outs()
            if len(outs) != 1:
                what = "add one, such as value = Out(Schema(...))"
                if outs:
                    what = f"set them ({', '.join(outs)}), and return None"
                raise SchemaError(
                    f"{type(self).__name__} has {len(outs) or 'no'} Outs, so it is not "
                    f"clear where the value goes that read() has returned; {what}."
                    " (R0503)"
                )
            setattr(self, outs[0], values)


class Process(Agent):
    """Computes outputs from inputs: a controller, a filter. Write `step`."""

    kind = "process"

    def step(self, tick: Tick) -> None:
        """Read the Ins, and set the Outs."""
        raise lacking(type(self), self.kind, "step(self, tick)")


class Output(Agent):
    """An output: results for a file, a plot, a screen. Write `write`."""

    kind = "output"

    def write(self, tick: Tick) -> None:
        """Take this tick's values of the Ins."""
        raise lacking(type(self), self.kind, "write(self, tick)")

    def step(self, tick: Tick) -> None:
        self.write(tick)

    def expected(self, ports: Mapping[str, Schema]) -> list[str]:
        """Return the names of the files and folders that it is going to make.

        ports: the schemas of what its Ins read, by key. A run that is killed leaves
        these names in run.json, so that the next run can move the files.
        """
        return []

    def made(self) -> list[Path]:
        """Return the files that this output has made; called after `close`."""
        return []


def files_of(output: Output) -> list[str]:
    """Return the result of `made()` as strings. Raises SchemaError if it is no list."""
    made: object = output.made()
    paths = [*made] if isinstance(made, Iterable) and not isinstance(made, str) else [0]
    if all(isinstance(path, str | Path) for path in paths):
        return [str(path) for path in paths]
    raise SchemaError(
        f"{written(output, 'made')} returns {made!r:.60}; expected a list of paths, "
        "such as [self.path]. (R0503)"
    )
