"""Env: one environment, in Gymnasium's terms, on a stage of robots."""

from collections.abc import Callable, Mapping
from math import isfinite
from pathlib import Path
from random import Random
from typing import Any

from rems_net.arguments import taught
from rems_net.defdict import DefDict
from rems_net.errors import ExperimentError, nearest
from rems_net.events import warn
from rems_net.gym.direct import Direct
from rems_net.gym.fabric import OnFabric
from rems_net.gym.library import Env
from rems_net.gym.offered import Ports, Starts
from rems_net.gym.spaces import Layout
from rems_net.gym.task import Moment, Names, Task, judges

#: The place where an environment's robots act.
Stage = Direct | OnFabric
#: Seeds of episodes are smaller than this.
SEEDS = 2**31
#: names of options of a reset
OPTIONS = {"record", "start"}


class Given:
    """The settings of an environment, checked.

    task: rewards, ends, starts.  steps: number of steps after which an episode is cut
    off; 0 for never.  normalise: numbers that have a range go from -1 to 1.  clip:
    whether an action out of range is limited.  seed: of the first episode without one.
    """

    def __init__(
        self,
        ports: Ports,
        task: Task,
        *,
        steps: int,
        normalise: bool,
        clip: bool,
        seed: int,
    ):
        self.act = Layout(ports.act, normalise=normalise, acts=True)
        self.observe = Layout(ports.observe, normalise=normalise, acts=False)
        self.task, self.steps, self.clip, self.seed = task, steps, clip, seed
        #: keys of the robots that start somewhere
        self.robots = ports.starts.keys()
        self.names = Names({**ports.observe, **ports.act})
        self.units = {**self.act.units, **self.observe.units}
        self._warned = False

    def judged(self, now: Moment, before: Moment) -> tuple[float, bool]:
        """Return the reward of a step, and whether it is the last.

        Raises ExperimentError.
        """
        reward, ends = self.task.reward(now, before), self.task.ends(now)
        try:
            found = float(reward), bool(ends)
        except (TypeError, ValueError):
            raise no_outcome(self.task, reward, ends) from None
        self.doubt(isfinite(found[0]), found[0])
        return found

    def doubt(self, fine: bool, reward: object) -> None:
        """Warn once of a reward that is not fine: no policy learns from it."""
        if not (fine or self._warned):
            self._warned = True
            warn(
                "reward",
                f"a reward is {reward}, from which no policy learns; look for a "
                "division by 0, or for a root or a logarithm below 0",
            )

    def starts(self, seed: int, options: Mapping[str, Any] | None) -> Starts:
        """Return where robots start in an episode. Raises ExperimentError."""
        for odd in {*(options or {})} - OPTIONS:  # others may be of a wrapper
            if meant := nearest(str(odd), OPTIONS):
                raise ExperimentError(
                    f"options has {odd!r}; expected record or start.{meant} (R0926)"
                )
        found: Any = (options or {}).get("start")
        if found is None:
            found = self.task.start(Random(f"{seed} start"))
        wrong = ""
        if isinstance(found, Mapping):
            if all(k in self.robots and isinstance(found[k], Mapping) for k in found):
                return found
            wrong = next(iter({*found} - {*self.robots}), "")
        raise ExperimentError(
            f"the start of an episode is {found!r:.80}; expected initial values by "
            f"robot, such as {{{next(iter(self.robots), 'robot/sim')!r}: "
            f"{{'x': 0.1}}}}.{nearest(str(wrong), self.robots)} (R0926)"
        )


def no_outcome(task: Task, reward: object, ends: object) -> ExperimentError:
    """Return the error of a task that gives something else."""
    return ExperimentError(
        f"{type(task).__name__}: reward() returned {reward!r:.60}, and ends() "
        f"{ends!r:.60}; expected a number, and True or False. (R0926)"
    )


class RobotEnv(Env[Any, Any]):
    """Robots of an experiment as an environment.

    stage: opens the stage; its argument is the folder of a recording, or None.
    units: of each field by its key, in the order of actions, then of observations.
    """

    metadata = {"render_modes": []}  # noqa: RUF012 - of Gymnasium

    def __init__(self, given: Given, stage: Callable[[Path | str | None], Stage]):
        self.given, self._make = given, stage
        self.action_space, self.observation_space = given.act.space, given.observe.space
        self.units = given.units
        self._stage: Stage | None = None
        self._special = self._over = False
        self._steps = -1
        self._acts, self._ports = [*given.act.schemas], [*given.observe.schemas.items()]
        self._acted: list[DefDict] = []
        #: the leaves of each observed port
        self._seen: list[list[Any]] = []
        self._now: Moment | None = None
        self._task = given.task if judges(given.task) else None

    @taught(ExperimentError)
    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode; the same seed gives the same one.

        options: {"record": "runs/one"} records this episode alone, in that folder;
        {"start": {"robot/sim": {"x": 0.1}}} sets where robots start.
        """
        if seed is None and self._steps < 0:
            seed = self.given.seed
        super().reset(seed=seed)
        own = seed
        if own is None:
            own = int(self.np_random.integers(SEEDS))
        starts = self.given.starts(own, options)
        stage = self._staged((options or {}).get("record"))
        stage.begin(own, starts)
        self._steps, self._over = 0, False
        self._look(stage, [schema() for schema in self.given.act.schemas.values()])
        return self.given.observe.read(self._seen), {}

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Act for one step. Raises FieldValueError for an action that does not fit."""
        given, task = self.given, self._task
        before = None if task is None or self._steps < 0 else self.now
        cut = self.advance(given.act.take(action, clip=given.clip))
        observation = given.observe.read(self._seen)
        if task is None or before is None:
            return observation, 0.0, False, cut, {}
        reward, ended = given.judged(self.now, before)
        self._over = self._over or ended
        return observation, reward, ended, cut, {}

    def advance(self, actions: list[DefDict]) -> bool:
        """Let the robots act for one step. Returns whether the episode is cut off."""
        stage = self._stage
        if stage is None or self._steps < 0:
            raise ExperimentError(
                "step() comes before the first reset(): begin with "
                "`observation, info = env.reset(seed=1)`. (R0927)"
            )
        if self._over:
            raise ExperimentError(
                "step() comes after the end of the episode: begin another one with "
                "`observation, info = env.reset()`. (R0927)"
            )
        stage.step(actions)
        self._look(stage, actions)
        self._steps += 1
        self._over = self._steps == self.given.steps
        return self._over

    def close(self) -> None:
        """Close the stage; a recording is complete then."""
        stage, self._stage, self._steps = self._stage, None, -1
        if stage is not None:
            stage.close()

    def _staged(self, record: Path | str | None) -> Stage:
        """Return the stage: one of its own for an episode that is recorded."""
        if self._stage is not None and (record is not None or self._special):
            self.close()
        if self._stage is None:
            self._stage = self._make(record)
            self._special = record is not None
        return self._stage

    @property
    def now(self) -> Moment:
        """The moment of the newest observation."""
        if self._now is None:
            ports: dict[str, Any] = dict(zip(self._acts, self._acted, strict=True))
            for (key, schema), leaves in zip(self._ports, self._seen, strict=True):
                ports[key] = schema.around(leaves)
            self._now = Moment(self.given.names, ports)
        return self._now

    def _look(self, stage: Stage, actions: list[DefDict]) -> None:
        self._acted, self._seen, self._now = actions, stage.leaves(), None
