"""VectorRobots: many environments at once, in Gymnasium's terms.

Kinematic robots are computed as columns. Others are stepped one by one; the engines of
robots in MuJoCo compute at the same time, in threads.
"""

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rems_net.agents.agent import Agent
from rems_net.agents.runtime import runtime
from rems_net.bodies.actuators import Actuators
from rems_net.defdict import Schema
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.drivers.kinematic.swarm import Columns, moved
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.errors import AgentError, ExperimentError
from rems_net.gym.direct import Direct
from rems_net.gym.env import SEEDS, Given, no_outcome
from rems_net.gym.library import AutoresetMode, VectorEnv, batch_space
from rems_net.gym.spaces import Floats
from rems_net.gym.task import Moment

Flags = NDArray[np.bool_]


class VectorRobots(VectorEnv[Any, Any, Any]):
    """Copies of an environment of one Box each; an episode that is over begins anew.

    The next step after an end begins the episode (NEXT_STEP). The n-th environment
    has seed + n.

    many: where their robots act.
    """

    metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012

    def __init__(self, given: Given, count: int, many: "AsColumns | AsStages"):
        for column in (*given.act.columns, *given.observe.columns):
            if not column.is_real:
                raise ExperimentError(
                    f"{column.name} is not a number, and many environments at once "
                    "take numbers only: leave vector or its port out. (R0929)"
                )
        self.given, self.num_envs, self._many = given, count, many
        self.single_action_space = given.act.space
        self.single_observation_space = given.observe.space
        self.action_space = batch_space(given.act.space, count)
        self.observation_space = batch_space(given.observe.space, count)
        self.units = given.units
        self._over = np.ones(count, bool)
        self._steps = np.zeros(count, int)
        self._begun = False

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode in all environments."""
        if seed is None and not self._begun:
            seed = self.given.seed
        super().reset(seed=seed)
        self._begun = True
        own = [*range(seed, seed + self.num_envs)] if seed is not None else []
        every = range(self.num_envs)
        self._begin(every, own or self._drawn(self.num_envs), options)
        self.now = self._moment(None)
        return self._seen(), {}

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Let all act for one step. Raises FieldValueError for a wrong action."""
        if not self._begun:
            raise ExperimentError(
                "step() comes before the first reset(): begin with "
                "`observations, infos = env.reset(seed=1)`. (R0927)"
            )
        given, over, before = self.given, self._over.copy(), self.now
        numbers = given.act.many(actions, self.num_envs, clip=given.clip)
        self._many.step(numbers, ~over)
        begin = np.flatnonzero(over).tolist()
        if begin:
            self._begin(begin, self._drawn(len(begin)))
        self.now = self._moment(numbers)
        self._steps += 1
        self._steps[over] = 0
        still = ~over
        cut = still & (self._steps == given.steps)
        reward, ends = given.task.reward(self.now, before), given.task.ends(self.now)
        try:
            reward = np.where(still, reward * np.ones(self.num_envs), 0.0)
            ended = still & np.asarray(ends, bool)
        except (TypeError, ValueError):
            raise no_outcome(given.task, reward, ends) from None
        given.doubt(bool(np.isfinite(reward).all()), "nan or infinite")
        self._over = ended | cut
        return self._seen(), reward, ended, cut, {}

    def close(self, **_: Any) -> None:
        """Release everything."""
        self._many.close()

    def _drawn(self, count: int) -> list[int]:
        drawn: list[int] = self.np_random.integers(SEEDS, size=count).tolist()
        return drawn

    def _begin(
        self,
        numbers: Sequence[int],
        seeds: Sequence[int],
        options: Mapping[str, Any] | None = None,
    ) -> None:
        if options and "record" in options:
            raise ExperimentError(
                "one environment alone can record an episode; leave vector or record "
                "out. (R0929)"
            )
        starts = [self.given.starts(one, options) for one in seeds]
        self._many.begin(numbers, seeds, starts)
        self._over[numbers] = False
        self._steps[numbers] = 0

    def _moment(self, actions: Floats | None) -> Moment:
        self._tables = self._many.tables()
        act, schemas = self.given.act, self.given.observe.schemas
        ports = {key: _columns(schemas[key], t) for key, t in self._tables.items()}
        if actions is None:
            actions = np.tile(act.rest, (self.num_envs, 1))
        for part, (key, schema) in zip(act.parts, act.schemas.items(), strict=True):
            ports.setdefault(key, _columns(schema, actions[:, part]))
        return Moment(self.given.names, ports)

    def _seen(self) -> Any:
        tables = [*self._tables.values()]
        whole = tables[0] if len(tables) == 1 else np.concatenate(tables, axis=1)
        return self.given.observe.scaled(whole).copy()


def _columns(schema: Schema, table: Floats) -> dict[str, Floats]:
    return {path: table[:, i] for i, path in enumerate(schema.paths)}


class AsColumns:
    """One kinematic robot, many times, as columns.

    robot: prepared.  command, observe: keys.  dt: of a step, in `ticks` ticks.
    """

    def __init__(
        self, robot: Agent, observe: Sequence[str], count: int, dt: float, ticks: int
    ):
        assert isinstance(robot, Kinematic)
        self._robot, self._observe, self._count = robot, observe, count
        self._dt, self._ticks = dt, ticks
        swarm = robot.columns([robot])
        assert swarm is not None
        self._swarm = swarm
        self._initial = dict(robot.initial)
        self._state: Floats = np.tile(np.array(robot.state.leaves()), (count, 1))
        self._command: Floats = np.zeros((count, len(robot.command.schema.fields)))

    @staticmethod
    def fit(robot: Agent, seconds: float) -> bool:
        """Return whether a robot that is all agents can be computed as columns.

        seconds: of a step, during which its command must stay valid.
        """
        return (
            isinstance(robot, Kinematic)
            and runtime(robot).every == 1
            and seconds <= robot.max_age
            and Actuators.of(robot.parameters, robot.command) is None
            and not robot.accelerometers
            and robot.columns([robot]) is not None
        )

    def begin(self, numbers: Sequence[int], seeds: Sequence[int], starts: Any) -> None:
        """Put these back to their starts; without noise, a seed changes nothing."""
        robot, rows = self._robot, []
        for start in starts:
            robot.initial = {**self._initial, **start.get(robot.key, {})}
            rows.append(robot.begins().leaves())
        self._state[numbers] = rows
        self._command[numbers] = robot.command.schema().leaves()

    def step(self, actions: Floats, others: Flags) -> None:
        """Let actions act on all of `others`."""
        self._command = actions.copy()
        state, command = self._as_columns("state"), self._as_columns("command")
        with np.errstate(all="ignore"):  # `table` finds NaN
            for _ in range(self._ticks):
                state = moved(self._swarm.integration, state, command, self._dt)
        table, bad = self._swarm.table("state", state, self._count)
        if bad >= 0:
            raise AgentError(
                self._robot.key,
                f"in environment {bad} its state is infinite, or beyond its range: "
                f"{table[bad].tolist()}. (R0305)",
            )
        self._state[others] = table[others]

    def tables(self) -> dict[str, Floats]:
        """Return the values of each observed port."""
        found = {"state": self._state, "command": self._command}
        if any(key.endswith("/sensors") for key in self._observe):
            assert self._robot.read is not None
            state, command = self._as_columns("state"), self._as_columns("command")
            read = self._robot.read(state, command)
            found["sensors"], _ = self._swarm.table("sensors", read, self._count)
        return {key: found[key.rpartition("/")[2]].copy() for key in self._observe}

    def close(self) -> None:
        """Do nothing: there are only arrays."""

    def _as_columns(self, port: str) -> Columns:
        table = self._state if port == "state" else self._command
        rows = np.ascontiguousarray(table.T)  # the same vector code as in a swarm
        paths = getattr(self._robot, port).schema.paths
        return Columns(zip(paths, rows, strict=True))


class AsStages:
    """Many stages, one after the other."""

    def __init__(self, make: Callable[[], Direct], given: Given, count: int):
        self._given = given
        self._stages = [make() for _ in range(count)]

    def begin(self, numbers: Sequence[int], seeds: Sequence[int], starts: Any) -> None:
        """Put these back to their starts."""
        for number, seed, start in zip(numbers, seeds, starts, strict=True):
            self._stages[number].begin(seed, start)

    def step(self, actions: Floats, others: Flags) -> None:
        """Let actions act on those that are in `others`."""
        for number in np.flatnonzero(others).tolist():
            action = self._given.act.grouped(actions[number].tolist())
            self._stages[number].step(action)

    def tables(self) -> dict[str, Floats]:
        """Return the values of each observed port."""
        rows = [stage.leaves() for stage in self._stages]
        flat: Any = list if self._given.observe.plain else np.hstack
        return {
            key: np.array([flat(row[n]) for row in rows], float)
            for n, key in enumerate(self._given.observe.schemas)
        }

    def close(self) -> None:
        """Close all stages."""
        for stage in self._stages:
            stage.close()


class AsEngines(AsStages):
    """Many robots, each alone in MuJoCo, whose engines compute at the same time.

    Threads step the engines, and nothing else: then none of them waits for Python.
    MuJoCo's own `rollout` would give other last bits from the second step on: it does
    not return the warm starts of its solver.
    """

    def __init__(self, make: Callable[[], Direct], given: Given, count: int):
        super().__init__(make, given, count)
        self._threads = min(count, os.cpu_count() or 1)
        self._pool = ThreadPoolExecutor(self._threads)

    @staticmethod
    def fit(robot: Agent) -> bool:
        """Return whether a robot that is all agents can be stepped so."""
        own = ("step", "obey", "acting", "drive", "sense")
        return (
            isinstance(robot, Mujoco)
            and runtime(robot).every == 1
            and all(getattr(type(robot), n) is getattr(Mujoco, n) for n in own)
        )

    def step(self, actions: Floats, others: Flags) -> None:
        """Let actions act on those that are in `others`."""
        some = [self._stages[number] for number in np.flatnonzero(others)]
        for stage, row in zip(some, actions[others].tolist(), strict=True):
            stage.put(self._given.act.grouped(row))
        for _ in range(some[0].ticks if some else 0):
            going = [stage.ticking() for stage in some]
            while due := [found for one in going if (found := next(one, None))]:
                shares = (due[n :: self._threads] for n in range(self._threads))
                for _ in self._pool.map(_all, shares):
                    pass  # it raises a share's error

    def close(self) -> None:
        """Close all stages, and the threads."""
        super().close()
        self._pool.shutdown()


def _all(calls: Sequence[Callable[[], None]]) -> None:
    for call in calls:
        call()
