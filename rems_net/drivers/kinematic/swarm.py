"""A swarm of kinematic robots: one definition, the same settings, stepped as arrays."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rems_net.agents.diagnosis import failure
from rems_net.agents.tick import Tick
from rems_net.defdict import DefDict, Schema, gather, scatter
from rems_net.drivers.kinematic.integration import Integration
from rems_net.drivers.kinematic.model import Model, feel, motion
from rems_net.drivers.kinematic.units import PROBES, probe
from rems_net.errors import AgentError

Floats = NDArray[np.float64]


class Columns(dict[str, Any]):
    """Field path to array, as a definition's mathematics reads it."""

    def __getattr__(self, name: str) -> Any:
        if name in self:
            return self[name]
        inside = {
            k[len(name) + 1 :]: v for k, v in self.items() if k.startswith(f"{name}/")
        }
        if not inside:
            raise AttributeError(name)
        return Columns(inside)

    def copy(self) -> Columns:
        """Return another with the same arrays."""
        return Columns(self)


class Swarm:
    """Steps many robots at once; bit by bit what stepping each of them does."""

    def __init__(self, robots: Sequence[Model]):
        self.robots = robots
        self.first = robots[0]
        self.integration = Integration(self.first, _ahead)
        self.state = self.first.state.schema
        self.command = self.first.command.schema
        self._limits: dict[str, tuple[Floats, Floats]] = {
            port: _limits(getattr(self.first, port).schema)
            for port in ("state", "sensors")
            if port in self.first.schemas()
        }

    @classmethod
    def of(cls, robots: Sequence[Model]) -> Swarm | None:
        """A swarm of these, or None where only one by one will do."""
        first = robots[0]
        if first.options["noise"]:  # each has its own
            return None
        ports = [first.state, first.command]
        if first.read is not None:
            ports.append(first.sensors)
        if not all(_floats(port.schema) for port in ports) or not _takes_arrays(first):
            return None
        return cls(robots)

    def step(self, tick: Tick) -> None:
        """What `Robot.step` does, for all."""
        with np.errstate(all="ignore"):  # what is no number is refused
            self._step(tick)

    def _step(self, tick: Tick) -> None:
        for robot in self.robots:
            robot.obey(tick)
        command = _gather(self.command, self._values("command"))
        state = _gather(self.state, self._values("state"))
        first, integration = self.first, self.integration
        h = tick.dt / integration.count
        if not integration.told:
            self._compare(state, command, h, tick.dt)
        for _ in range(integration.count):
            mean = integration.mean(state, command, h)
            gone = first.advanced(state, command, h) if first.advanced else None
            state = _ahead(state, mean, h)
            if gone:
                state = Columns({**state, **gone})
        self._scatter("state", state, tick.dt)
        if first.read is not None:
            sensors = first.read(state, command)
            if first.accelerometers:
                sensors = {**self._feel(state, command, tick.dt), **sensors}
            self._scatter("sensors", sensors, tick.dt)

    def _compare(self, state: Columns, command: Columns, h: float, dt: float) -> None:
        """Warn, once for all, if steps are too long for one of them."""
        told = np.array([*command.values()])
        bad = self.integration.disagrees(state, command, h, told)
        if np.any(bad):
            one = self.robots[int(np.argmax(bad))].integration
            one.tell(h, dt)
            self.integration.told = one.told

    def _feel(self, state: Columns, command: Columns, dt: float) -> dict[str, Any]:
        """What accelerometers read, of robots that have gone on for `dt` seconds."""
        first = self.first
        goes = motion(state, first.rates(state, command))
        went = np.array([robot.goes for robot in self.robots]).T
        rows = np.broadcast_arrays(*goes)
        for robot, *now in zip(
            self.robots, *(row.tolist() for row in rows), strict=True
        ):
            robot.went, robot.goes = robot.goes, (now[0], now[1], now[2])
        return feel(first.accelerometers, (went[0], went[1], went[2]), goes, dt)

    def _scatter(self, port: str, columns: Mapping[str, Any], dt: float) -> None:
        """Bring the robots' own values up to date, as strictly as one by one."""
        values = self._values(port)
        schema = values[0].schema
        table = np.empty((len(values), len(schema.paths)))
        for i, path in enumerate(schema.paths):
            table[:, i] = columns[path]
        low, high = self._limits[port]
        fits = (table >= low) & (table <= high)  # False for NaN too
        rows = table.tolist()
        if not fits.all():
            bad = int(np.argmin(fits.all(axis=1)))
            row = dict(zip(schema.paths, rows[bad], strict=True))
            refuse(self.robots[bad], port, row, dt)
        scatter(rows, values)

    def _values(self, port: str) -> list[DefDict]:
        """The live values of a port; not by its name, which would mark it as set."""
        return [robot.__dict__[port] for robot in self.robots]


def refuse(robot: Model, port: str, row: dict[str, float], dt: float) -> None:
    """Say which robot's mathematics left the limits of its schema, and how."""
    try:
        if port == "state":
            robot.drive(robot.command, dt)  # says it as it would alone
        setattr(robot, port, row)
    except Exception as error:
        raise AgentError(*failure(robot.key, error, robot.tick.n)) from error


def _gather(schema: Schema, values: Sequence[DefDict]) -> Columns:
    # One row of memory for each field: the same vector code for every swarm.
    columns = np.ascontiguousarray(gather(values).T)
    return Columns(zip(schema.paths, columns, strict=True))


def _ahead(state: Columns, rates: Mapping[str, Any], h: float) -> Columns:
    return Columns(state | {path: state[path] + h * r for path, r in rates.items()})


def _limits(schema: Schema) -> tuple[Floats, Floats]:
    limits = [field.limits for field in schema.fields]
    return np.array([low for low, _ in limits]), np.array([high for _, high in limits])


def _floats(schema: Schema) -> bool:
    return all(f.dtype == "float" and not f.shape for f in schema.fields)


def _takes_arrays(robot: Model) -> bool:
    """Whether the definition gives for arrays what it gives for each element."""
    functions: list[Callable[[Any, Any], Mapping[str, Any]]] = [robot.rates]
    if robot.read is not None:
        functions.append(robot.read)
    if (advanced := robot.advanced) is not None:
        functions.append(lambda state, command: advanced(state, command, 0.1))
    states = [probe(robot.state, by) for by in PROBES]
    commands = [probe(robot.command, by) for by in PROBES]
    state = _gather(robot.state.schema, states)
    command = _gather(robot.command.schema, commands)
    with np.errstate(all="ignore"):
        for function in functions:
            try:
                columns = function(state, command)
                rows = [function(s, c) for s, c in zip(states, commands, strict=True)]
            except (TypeError, ValueError, AttributeError):
                return False
            for path, values in columns.items():
                wide = np.broadcast_to(values, len(rows))
                if any(float(r[path]) != v for r, v in zip(rows, wide, strict=True)):
                    return False
    return True
