"""Direct: the stage of an environment in this process, on an engine."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from rems_net.agents.diagnosis import failure
from rems_net.agents.experiment.experiment import Experiment
from rems_net.agents.experiment.solo import Solo
from rems_net.agents.runtime import runtime
from rems_net.agents.tick import Tick, time_of
from rems_net.defdict import DefDict
from rems_net.errors import AgentError
from rems_net.gym.offered import Ports, Starts, beginnings, begins_by_verbs, with_starts

if TYPE_CHECKING:
    from rems_net.drivers.physics.physics import Physics


class Direct:
    """An experiment in this process, with values that an environment puts.

    ports: what is put and read.  ticks: of one step.  out: folder of the recording;
    None for none.
    """

    def __init__(
        self, lab: Experiment, ports: Ports, ticks: int, out: Path | str | None = None
    ):
        self.lab, self.ports, self.ticks = lab, ports, ticks
        self._engine: Solo = lab.engine(out)
        self._opened = False

    def begin(self, seed: int, starts: Starts) -> None:
        """Put everything back to its start, with this seed.

        Robots and worlds are put back while time goes on. An experiment with other
        agents begins again as a whole: these may have kept anything.
        """
        engine, verbs = self._engine, begins_by_verbs(self.lab)
        if not verbs:
            with_starts(self.lab, starts)
            engine.reset(seed)
        elif not self._opened:
            engine.open()
        if not (verbs and self._opened):
            self._ins = [engine.inlet(key) for key in self.ports.act]
            ports = [key.rpartition("/") for key in self.ports.observe]
            self._ports = [(engine[key].__dict__, port) for key, _, port in ports]
        self._opened = True
        for key, initial in beginnings(self.lab, starts) if verbs else ():
            engine[key].reset(seed=seed, initial=initial)

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

    def leaves(self) -> list[list[Any]]:
        """Return the leaves of each observed port, in schema order."""
        return [own[port].leaves() for own, port in self._ports]

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
