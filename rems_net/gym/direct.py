"""Direct: the stage of an environment in this process, on an engine."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, cast

from rems_net.agents.diagnosis import failure
from rems_net.agents.experiment.experiment import Experiment
from rems_net.agents.experiment.solo import Solo
from rems_net.agents.runtime import runtime
from rems_net.agents.tick import Tick, time_of
from rems_net.defdict import DefDict
from rems_net.errors import AgentError
from rems_net.gym.offered import (
    Starts,
    begins_by_verbs,
    reset_keys,
    start_of,
    starts_in,
    with_starts,
)

if TYPE_CHECKING:
    from rems_net.drivers.physics.physics import Physics


class Stage(Protocol):
    """The place where an environment's robots act: an engine, or a fabric."""

    def begin(self, seed: int, starts: Starts) -> None:
        """Put everything back to its start, with this seed."""

    def step(self, actions: Sequence[DefDict]) -> None:
        """Put the actions at their Ins, and let them act for one step."""

    def values(self) -> list[DefDict]:
        """Return the values of the observed ports: copies, in their order."""

    def close(self) -> None:
        """Release everything."""


class Direct:
    """An experiment in this process, with values that an environment puts.

    act, observe: keys of Ins and of ports.  ticks: of one step.  out: folder of the
    recording; None for none.
    """

    def __init__(
        self,
        lab: Experiment,
        act: Sequence[str],
        observe: Sequence[str],
        ticks: int,
        out: Path | str | None = None,
    ):
        self.lab, self.act, self.observe, self.ticks = lab, act, observe, ticks
        self._engine: Solo = lab.engine(out)
        self._resets: list[tuple[str, Callable[..., None]]] = []
        self._opened = False

    def begin(self, seed: int, starts: Starts) -> None:
        """Put everything back to its start, with this seed.

        Robots and worlds are put back while time goes on. An experiment with other
        agents begins again as a whole: these may have kept anything.
        """
        if not self._opened or not begins_by_verbs(self.lab):
            self._open_anew(seed, starts)
            return
        for key, reset in self._resets:
            if key.startswith("robot/"):
                reset(seed=seed, initial=start_of(self.lab.plans[key], starts))
            else:
                reset(seed=seed, initial=starts_in(self.lab, key, starts))

    def _open_anew(self, seed: int, starts: Starts) -> None:
        first = begins_by_verbs(self.lab)
        engine = self._engine
        if not first:
            with_starts(self.lab, starts)
            engine.reset(seed)
        else:
            engine.open()
        self._opened = True
        self._ins = [engine.inlet(key) for key in self.act]
        self._ports = []
        for key in self.observe:
            own, port = engine[key.rpartition("/")[0]].__dict__, key.rpartition("/")[2]
            self._ports.append((own, port, own[port].schema.around))
        self._resets = [(key, engine[key].reset) for key in reset_keys(self.lab)]
        if first:
            self.begin(seed, starts)

    def step(self, actions: Sequence[DefDict]) -> None:
        """Put the actions at their Ins, and let them act for one step."""
        self.put(actions)
        self._engine.step(self.ticks)

    def put(self, actions: Sequence[DefDict]) -> None:
        """Put the actions at their Ins."""
        for inlet, action in zip(self._ins, actions, strict=True):
            self._engine.put_at(inlet, action)

    def ticking(self) -> Iterator[Callable[[], None]]:
        """Do one tick of a robot that is alone in a physics engine.

        Yields each calculation of that, to be called before the next one is taken.
        """
        solo, robot = self._engine, cast("Physics", self._ins[0].agent)
        tick = Tick(solo.n + 1, time_of(solo.n + 1, solo.dt), solo.dt)
        runtime(robot).begin(tick)
        going, blamed = robot.stepping(tick), partial(_blamed, robot.key, tick.n)
        while (due := blamed(partial(next, going, None))) is not None:
            yield partial(blamed, due)
        solo.n = tick.n

    def values(self) -> list[DefDict]:
        """Return the values of the observed ports: copies, in their order."""
        return [made(own[port].leaves()) for own, port, made in self._ports]

    def close(self) -> None:
        """Close the engine."""
        self._opened = False
        self._engine.close()


def _blamed(key: str, n: int, call: Callable[[], Any]) -> Any:
    """Return a call's result. Raises AgentError of this agent, at tick n."""
    try:
        return call()
    except Exception as error:
        raise AgentError(*failure(key, error, n)) from error
