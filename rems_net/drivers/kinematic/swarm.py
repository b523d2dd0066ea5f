"""A swarm of kinematic robots: one definition, the same settings, stepped as arrays."""

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
    """Arrays by field path, for a definition's mathematics."""

    def __getattr__(self, name: str) -> Any:
        if name in self:
            return self[name]
        inside = {
            k[len(name) + 1 :]: v for k, v in self.items() if k.startswith(f"{name}/")
        }
        if not inside:
            raise AttributeError(name)
        return Columns(inside)

    def copy(self) -> "Columns":
        """Return a copy with the same arrays."""
        return Columns(self)


class Swarm:
    """Many robots, stepped at once with the same bits as one by one."""

    def __init__(self, robots: Sequence[Model]):
        self.robots = robots
        self.first = robots[0]
        self.integration = Integration(self.first, ahead)
        self.state = self.first.state.schema
        self.command = self.first.command.schema
        self._limits: dict[str, tuple[Floats, Floats]] = {
            port: _limits(getattr(self.first, port).schema)
            for port in ("state", "sensors")
            if port in self.first.schemas()
        }

    @classmethod
    def of(cls, robots: Sequence[Model]) -> "Swarm | None":
        """Return a swarm of the robots; None if they must be stepped one by one."""
        first = robots[0]
        if first.options["noise"]:  # each robot has its own
            return None
        ports = [first.state, first.command]
        if first.read is not None:
            ports.append(first.sensors)
        if not all(_floats(port.schema) for port in ports) or not _takes_arrays(first):
            return None
        return cls(robots)

    def step(self, tick: Tick) -> None:
        """Step all robots, as `Robot.step` does for one."""
        with np.errstate(all="ignore"):  # _scatter refuses NaN
            self._step(tick)

    def _step(self, tick: Tick) -> None:
        for robot in self.robots:
            robot.obey(tick)
        acting = [robot.acting(tick.dt) for robot in self.robots]
        command = _gather(self.command, acting)
        state = _gather(self.state, self._values("state"))
        first, integration = self.first, self.integration
        if not integration.told:
            self._compare(state, command, tick.dt / integration.count, tick.dt)
        state = self.moved(state, command, tick.dt)
        self._scatter("state", state, tick.dt)
        if first.read is not None:
            sensors = first.read(state, command)
            if first.accelerometers:
                sensors = {**self._feel(state, command, tick.dt), **sensors}
            self._scatter("sensors", sensors, tick.dt)

    def moved(self, state: Columns, command: Columns, dt: float) -> Columns:
        """Return the state after `dt` seconds of the command."""
        return moved(self.integration, state, command, dt, self.integration.count)

    def _compare(self, state: Columns, command: Columns, h: float, dt: float) -> None:
        """Warn, once for the swarm, if steps are too long for one of its robots."""
        told = np.array([*command.values()])
        bad = self.integration.disagrees(state, command, h, told)
        if np.any(bad):
            one = self.robots[int(np.argmax(bad))].integration
            one.tell(h, dt)
            self.integration.told = one.told

    def _feel(self, state: Columns, command: Columns, dt: float) -> dict[str, Any]:
        """Return the accelerometers' values after a step of `dt` seconds."""
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
        """Copy the columns to the robots' values, as strictly as one by one."""
        values = self._values(port)
        schema = values[0].schema
        table, bad = self.table(port, columns, len(values))
        rows = table.tolist()
        if bad >= 0:
            row = dict(zip(schema.paths, rows[bad], strict=True))
            refuse(self.robots[bad], port, row, dt)
        scatter(rows, values)

    def table(
        self, port: str, columns: Mapping[str, Any], count: int
    ) -> tuple[Floats, int]:
        """Return columns as rows (count, fields), and the first row beyond its limits.

        That is -1 if all rows fit.
        """
        paths = getattr(self.first, port).schema.paths
        table = np.empty((count, len(paths)))
        for i, path in enumerate(paths):
            table[:, i] = columns[path]
        low, high = self._limits[port]
        fits = (table >= low) & (table <= high)  # False for NaN too
        return table, -1 if fits.all() else int(np.argmin(fits.all(axis=1)))

    def _values(self, port: str) -> list[DefDict]:
        """Return a port's live values; not by attribute, which would mark them set."""
        return [robot.__dict__[port] for robot in self.robots]


def refuse(robot: Model, port: str, row: dict[str, float], dt: float) -> None:
    """Raise AgentError for the robot whose values are outside of their limits."""
    try:
        if port == "state":
            robot.drive(robot.command, dt)  # raises the error of a single robot
        setattr(robot, port, row)
    except Exception as error:
        raise AgentError(*failure(robot.key, error, robot.tick.n)) from error


def _gather(schema: Schema, values: Sequence[DefDict]) -> Columns:
    # One row of memory for each field: the same vector code for every swarm.
    columns = np.ascontiguousarray(gather(values).T)
    return Columns(zip(schema.paths, columns, strict=True))


def moved(
    integration: Integration, state: Columns, command: Columns, dt: Any, count: int
) -> Columns:
    """Return the state after `dt` seconds of the command, in `count` steps."""
    advanced, h = integration.robot.advanced, dt / count
    for _ in range(count):
        rates = integration.mean(state, command, h)
        gone = advanced(state, command, h) if advanced else None
        state = ahead(state, rates, h)
        if gone:
            state = Columns({**state, **gone})
    return state


def ahead(state: Columns, rates: Mapping[str, Any], h: float) -> Columns:
    return Columns(state | {path: state[path] + h * r for path, r in rates.items()})


def _limits(schema: Schema) -> tuple[Floats, Floats]:
    limits = [field.limits for field in schema.fields]
    return np.array([low for low, _ in limits]), np.array([high for _, high in limits])


def _floats(schema: Schema) -> bool:
    return all(f.dtype == "float" and not f.shape for f in schema.fields)


def _takes_arrays(robot: Model) -> bool:
    """Return whether the definition computes arrays as it computes each element."""
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
