"""VectorRobots: many environments at once, in Gymnasium's terms.

Kinematic robots are computed as columns. Others are stepped one by one, by threads that
each have their share of them: a physics engine computes while others run Python.
"""

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from random import Random
from threading import Lock
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from rems_net.agents.robot import Robot
from rems_net.agents.runtime import runtime
from rems_net.defdict import Schema
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.drivers.kinematic.swarm import Columns, Swarm
from rems_net.errors import AgentError, ExperimentError
from rems_net.gym.direct import Stage
from rems_net.gym.env import SEEDS, Given
from rems_net.gym.library import AutoresetMode, VectorEnv, batch_space
from rems_net.gym.spaces import Floats
from rems_net.gym.task import Moment

Flags = NDArray[np.bool_]


class Many(Protocol):
    """The places where the robots of many environments act."""

    def begin(self, numbers: Sequence[int], seeds: Sequence[int], starts: Any) -> None:
        """Put these environments back to their starts, with these seeds."""

    def step(self, actions: Floats, others: Flags) -> None:
        """Let actions (n, fields) act for one step on those that are in `others`."""

    def tables(self) -> dict[str, Floats]:
        """Return the values of each observed port: (n, fields)."""

    def close(self) -> None:
        """Release everything."""


class VectorRobots(VectorEnv[Any, Any, Any]):
    """Copies of an environment of one Box each; an episode that is over begins anew.

    The next step after an end begins the episode (NEXT_STEP). The n-th environment
    has seed + n.
    """

    metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012

    def __init__(self, given: Given, count: int, many: Many):
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
        self._begin(range(self.num_envs), own or self._drawn(self.num_envs))
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
        every = np.ones(self.num_envs)
        reward = np.where(still, given.task.reward(self.now, before) * every, 0.0)
        given.doubt(bool(np.isfinite(reward).all()), "nan or infinite")
        ended = still & (np.asarray(given.task.ends(self.now)) & np.ones_like(over))
        self._over = ended | cut
        return self._seen(), reward, ended, cut, {}

    def close(self, **_: Any) -> None:
        """Release everything."""
        self._many.close()

    def _drawn(self, count: int) -> list[int]:
        drawn: list[int] = self.np_random.integers(SEEDS, size=count).tolist()
        return drawn

    def _begin(self, numbers: Sequence[int], seeds: Sequence[int]) -> None:
        starts = [self.given.task.start(Random(f"{one} start")) for one in seeds]
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
        self, robot: Robot, observe: Sequence[str], count: int, dt: float, ticks: int
    ):
        self._robot, self._observe, self._count = robot, observe, count
        self._dt, self._ticks = dt, ticks
        columns = robot.columns([robot]) if isinstance(robot, Kinematic) else None
        assert columns is not None
        self._swarm: Swarm = columns
        self._initial = dict(robot.initial)
        self._state: Floats = np.tile(np.array(robot.state.leaves()), (count, 1))
        self._command: Floats = np.zeros((count, len(robot.command.schema.fields)))

    @staticmethod
    def fit(robot: Robot, observe: Sequence[str]) -> bool:
        """Return whether this robot can be computed as columns."""
        return (
            isinstance(robot, Kinematic)
            and robot.shared is None
            and runtime(robot).every == 1
            and not robot.accelerometers
            and robot.columns([robot]) is not None
            and {key.rpartition("/")[0] for key in observe} == {robot.key}
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
                state = self._swarm.moved(state, command, self._dt)
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
            assert self._robot.read is not None  # type: ignore[attr-defined]
            state, command = self._as_columns("state"), self._as_columns("command")
            read = self._robot.read(state, command)  # type: ignore[attr-defined]
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
    """Many stages, in threads: each thread has a share of them, and opens it.

    MuJoCo's own `rollout` would give other last bits from the second step on: it does
    not return the warm starts of its solver.
    """

    def __init__(self, make: Callable[[], Stage], given: Given, count: int):
        self._given = given
        threads = min(count, os.cpu_count() or 1)
        self._stages = [make() for _ in range(count)]
        self._shares = [range(n, count, threads) for n in range(threads)]
        self._threads = [ThreadPoolExecutor(1) for _ in self._shares]
        #: building an engine changes the experiment's plans
        self._lock = Lock()

    def begin(self, numbers: Sequence[int], seeds: Sequence[int], starts: Any) -> None:
        """Put these back to their starts."""
        due = dict(zip(numbers, zip(seeds, starts, strict=True), strict=True))

        def begin(number: int) -> None:
            if number in due:
                with self._lock:
                    self._stages[number].begin(*due[number])

        self._each(begin)

    def step(self, actions: Floats, others: Flags) -> None:
        """Let actions act on those that are in `others`."""
        take = self._given.act.grouped

        def step(number: int) -> None:
            if others[number]:
                self._stages[number].step(take(actions[number].tolist()))

        self._each(step)

    def tables(self) -> dict[str, Floats]:
        """Return the values of each observed port."""
        rows: list[Any] = [stage.values() for stage in self._stages]
        keys = self._given.observe.schemas
        return {
            key: np.array([np.hstack(row[n].leaves()) for row in rows], float)
            for n, key in enumerate(keys)
        }

    def close(self) -> None:
        """Close all stages, each in its thread."""
        self._each(lambda number: self._stages[number].close())
        for thread in self._threads:
            thread.shutdown()

    def _each(self, function: Callable[[int], None]) -> None:
        def some(share: Sequence[int]) -> None:
            for number in share:
                function(number)

        pairs = zip(self._threads, self._shares, strict=True)
        for done in [thread.submit(some, share) for thread, share in pairs]:
            done.result()
