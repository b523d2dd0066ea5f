"""Runtime: a run's data about one agent, apart from the user's own attributes."""

from collections.abc import Mapping
from dataclasses import InitVar, dataclass, field
from typing import Any, Protocol

from rems_net.agents.background.jobs import Jobs
from rems_net.agents.tick import Tick, time_of
from rems_net.defdict import Rule

#: Key of the runtime in an agent's `__dict__`. No attribute can have this name, so
#: users' attributes may have any.
RUNTIME = "run time"
#: s. Two times of the fabric that are closer than this are the same.
SAME = 1e-9


class Guard(Protocol):
    """Age of ticks and STOP: a device thread checks them before it obeys a command.

    Both may be read from any thread, at any rate, and return at once.
    """

    @property
    def stopped(self) -> bool:
        """Whether STOP holds: true from the moment in which it arrives."""

    def age(self, n: int) -> float:
        """Return the upper bound of the age of tick `n`, in seconds of wall time.

        It holds for ticks of any machine, and on any way here; infinite for a tick that
        the clock does not know.
        """


@dataclass(slots=True, eq=False)
class Runtime:
    """Run state of one agent. The engine writes it; agents do not.

    key: of the agent.  ins: names of its Ins.  every: it steps at each tick n with
    n % every == 0.
    """

    key: InitVar[str]
    ins: tuple[str, ...]
    every: int
    #: False on an open fabric, where the clock waits for no agent
    in_step: bool
    kind: str = field(init=False)
    jobs: Jobs = field(init=False)
    tick: Tick = field(init=False)
    #: seed of the experiment
    seed: int = 0
    #: rules for the values that its Ins read
    rules: tuple[Rule, ...] = ()
    #: how often the agent's process was started again after a crash
    restarts: int = 0
    #: by In: its source
    sources: Mapping[str, str] = field(default_factory=dict)
    #: If several agents write a robot's command: for each, by its port such as
    #: `command/input/base`, the safe values of the fields that it writes.
    shares: dict[str, dict[str, Any]] = field(default_factory=dict)
    #: by In: the source tick of its value
    source_ticks: dict[str, int] = field(default_factory=dict)
    #: s. Length of the run's ticks, of which this agent may step every k-th.
    dt: float = 0.0
    #: the source tick of the values that the agent writes now
    source_tick: int = 0
    #: whether the agent has set one of its Outs in this step
    touched: bool = False
    #: names of the Outs that the agent has ever set
    written: dict[str, bool] = field(default_factory=dict)
    #: Ins through which the agent reads its own output; their age means nothing
    feedback: set[str] = field(default_factory=set)
    #: whether STOP holds, by the newest tick
    stopped: bool = False
    #: for a driven robot in a host: the age of ticks by the wall clock
    guard: Guard | None = None

    def __post_init__(self, key: str) -> None:
        self.kind, self.jobs = key.partition("/")[0], Jobs(key)
        self.tick = Tick(0, 0.0, 0.0)

    def begin(self, tick: Tick) -> Tick:
        """Return the tick as this agent steps it; deliver the jobs that have ended."""
        k, self.dt = self.every, tick.dt
        self.tick = tick if k == 1 else tick._replace(dt=time_of(k, tick.dt))
        self.touched = False
        if self.kind not in ("input", "process"):
            self.source_tick = tick.n
        if self.jobs.any:
            self.jobs.deliver(tick.n, in_step=self.in_step)
        return self.tick

    def end(self) -> None:
        """Set the source tick of the values that the agent has written in this step.

        For a robot, a world or an output, it is the tick itself (see `begin`). A
        robot's command is as old as its source, however often it was passed on: the
        value of an input that sets nothing grows old, and a process's value is as old
        as the oldest value that it reads.
        """
        if self.kind == "process":
            if self.touched:
                ticks = self.source_ticks
                ins = [p for p in self.ins if p in self.sources]
                read = [ticks.get(p, 0) for p in ins if p not in self.feedback]
                self.source_tick = min(read, default=self.tick.n)
        elif self.kind == "input" and self.touched:
            self.source_tick = self.tick.n

    def source_time(self, port: str) -> float | None:
        """Return the fabric time [s] of an In's source tick; None without a value."""
        n = self.source_ticks.get(port)
        return None if n is None else time_of(n, self.dt)

    def forget(self) -> None:
        """Forget a clock that is gone, and how old the values are."""
        self.source_ticks.clear()
        self.source_tick = 0

    @property
    def held(self) -> bool:
        """Whether STOP holds, by a tick or by the guard."""
        return self.stopped or (self.guard is not None and self.guard.stopped)

    def must_stand(self, age: float, max_age: float) -> bool:
        """Return whether a robot must obey its safe command, not one of this age.

        age, max_age: seconds, of fabric time in a model, of wall time in a device's
        thread. An age that is no number is too old.
        """
        return self.held or not age <= max_age

    def command_age(self, tick: Tick, port: str = "command") -> float:
        """Return the age of its command as the step begins [s]; 0 if it has none.

        port: of one of several writers, such as `command/input/base`.
        """
        n = self.source_ticks.get(port)
        return 0.0 if n is None else tick.t - tick.dt - time_of(n, self.dt) + SAME

    def overdue(self, tick: Tick, max_age: float) -> dict[str, Any]:
        """Return safe values for those of several writers whose commands are too old.

        They are flat, by the paths of the fields.
        """
        safe: dict[str, Any] = {}
        obeyed: list[int] = []
        for port, values in self.shares.items():
            if self.must_stand(self.command_age(tick, port), max_age):
                safe |= values
            elif port in self.source_ticks:
                obeyed.append(self.source_ticks[port])
        if obeyed:  # the whole command of a device counts as old as its oldest part
            self.source_ticks["command"] = min(obeyed)
        return safe


def runtime(agent: object) -> Runtime:
    """Return the run state of an agent."""
    found: Any = agent.__dict__[RUNTIME]
    run: Runtime = found
    return run
