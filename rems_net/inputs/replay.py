"""Replay: agents that publish the values of a recording, at its ticks."""

from collections.abc import Iterator
from functools import cache
from typing import Any

from rems_net.agents.agent import Agent, Input, Process
from rems_net.agents.ports import In, Out, Settings
from rems_net.agents.robot import Driver
from rems_net.agents.tick import Tick
from rems_net.defdict import DefDict, Schema, cdr, text
from rems_net.errors import ExperimentError, nearest, some
from rems_net.recordings.mcap.columns import agents_of
from rems_net.recordings.mcap.reader import McapFile
from rems_net.recordings.mcap.writer import FILE
from rems_net.teleop.keys import KEYBOARD
from rems_net.teleop.stick import STICK

#: what stands between the kind and the ports in the name of a class
MARK = "__"
#: what robots take from a hand by its own schema; a recording has another order
HANDS = {one.digest: one for one in (STICK, KEYBOARD)}
#: ns. After every recorded value.
NEVER = 1 << 63

FILE_OPTION = text(max_len=4096, doc="an MCAP file, or the folder of a run")
AGENT_OPTION = text(doc='key of the recorded agent, "input/keys"; its own if empty')


class Values:
    """Values of the ports of one recorded agent, in the order of time."""

    def __init__(self, agent: Agent, file: str, key: str) -> None:
        path = agent.folder / (file or ".")
        if not file:
            raise ExperimentError(
                'its file is not named; write options={"file": "run.mcap"}. (R0847)'
            )
        path = path / FILE if path.is_dir() else path
        self.file, self.agent = McapFile(path), key or agent.key
        agents = agents_of(self.file)
        if self.agent not in agents:
            raise ExperimentError(
                f"{path.name} has no agent {self.agent!r}; it has "
                f"{some(agents) if agents else 'none'}.{nearest(self.agent, agents)} "
                "(R0847)"
            )

    def schemas(self) -> dict[str, Schema]:
        """Return the schemas by port."""
        return {
            key.rpartition("/")[2]: HANDS.get(schema.digest, schema)
            for key, schema in self.file.schemas.items()
            if key.rpartition("/")[0] == self.agent
        }

    def begin(self) -> None:
        """Begin at the first recorded value."""
        self._values = {port: self._of(port) for port in self.schemas()}
        self._next = {port: next(values) for port, values in self._values.items()}

    def _of(self, port: str) -> Iterator[tuple[int, DefDict | None]]:
        """Yield time [ns] and value of a port; at last a time that never comes."""
        key = f"{self.agent}/{port}"
        decode = cdr(self.file.schemas[key]).decode
        for times, messages in self.file.messages(key):
            yield from zip(times, map(decode, messages), strict=True)
        yield NEVER, None

    def until(self, tick: Tick) -> Iterator[tuple[str, DefDict]]:
        """Yield port and newest value of what was recorded since the last tick."""
        for port in self._next:
            value: DefDict | None = None
            while self._next[port][0] <= round(tick.t * 1e9):
                value = self._next[port][1]
                self._next[port] = next(self._values[port])
            if value is not None:
                yield port, value

    @property
    def end(self) -> float:
        """Time of its last value [s]."""
        times = [self.file.times(f"{self.agent}/{port}") for port in self.schemas()]
        return max((int(one[-1]) for one in times if len(one)), default=0) / 1e9


class ReplayInput(Input):
    """Plays a recorded input: the values of a person, or of any agent with one port.

    It gives each value at the tick at which it was recorded, so a run with it has the
    same bytes. `file` is relative to the experiment's folder.
    """

    options = Settings(file=FILE_OPTION, agent=AGENT_OPTION)
    value = Out()

    def prepare(self) -> None:
        """Find the recorded agent. Raises ExperimentError."""
        super().prepare()
        self._values = Values(self, self.options.file, self.options.agent)
        ports = self._values.schemas()
        self._port = "value" if "value" in ports else next(iter(ports))
        if len(ports) > 1 and "value" not in ports:
            raise ExperimentError(
                f"{self._values.agent} has the ports {', '.join(ports)}; an input "
                "plays one that is named value, or the only one. (R0847)"
            )
        self.settle("value", ports[self._port])

    @property
    def end(self) -> float:
        """Time of the last recorded value [s]."""
        return self._values.end

    def open(self) -> None:
        """Begin at the first recorded value."""
        self._values.begin()

    def read(self, tick: Tick) -> None:
        """Set the newest value that was recorded until now."""
        for port, value in self._values.until(tick):
            if port == self._port:
                self.value = value


class Player(Driver):
    """Plays a recorded robot: command, state and sensors are those of its recording.

    It obeys no command, and STOP does not stop it: nothing moves.
    """

    obeys = False

    options = Settings(file=FILE_OPTION, agent=AGENT_OPTION)
    command = In()
    state = Out()
    sensors = Out()

    def prepare(self) -> None:
        """Take the ports of the recorded robot. Raises ExperimentError."""
        self._values = Values(self, self.options.file, self.options.agent)
        ports = self._values.schemas()
        if not {"command", "state"} <= ports.keys():
            raise ExperimentError(
                f"{self._values.agent} has {', '.join(ports)} in the recording; "
                "expected the command and the state of a robot. (R0847)"
            )
        for port, schema in ports.items():
            self.settle(port, schema)
        super().prepare()

    def open(self) -> None:
        """Begin at the first recorded value."""
        self._values.begin()

    def step(self, tick: Tick) -> None:
        """Set the newest values that were recorded until now."""
        for port, value in self._values.until(tick):
            if port == "command":
                self.__dict__["command"] = value
            else:
                setattr(self, port, value)


class _Played:
    """Base of inputs and processes that play the recording of one like them."""

    options = Settings(file=FILE_OPTION, agent=AGENT_OPTION)

    def prepare(self: Any) -> None:
        self._values = Values(self, self.options.file, self.options.agent)
        for port, schema in self._values.schemas().items():
            self.settle(port, schema)

    def open(self: Any) -> None:
        self._values.begin()

    def step(self: Any, tick: Tick) -> None:
        for port, value in self._values.until(tick):
            setattr(self, port, value)


def __getattr__(name: str) -> type[Agent]:
    """Return a class by its kind and its ports: `process__value__warning`.

    So another process finds it by its name. Raises AttributeError.
    """
    kind, *ports = name.split(MARK)
    if kind not in ("input", "process") or not ports:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return _made(kind, tuple(ports))


@cache
def _made(kind: str, ports: tuple[str, ...]) -> type[Agent]:
    base = Input if kind == "input" else Process
    slots: dict[str, Any] = {port: Out() for port in ports}
    name = MARK.join([kind, *ports])
    about = {"__module__": __name__, "__doc__": "Plays a recorded agent."}
    return type(name, (_Played, base), {**about, **slots})
