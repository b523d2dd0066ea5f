"""ParallelRobots: the robots of an experiment as agents, in PettingZoo's terms."""

from collections.abc import Mapping
from importlib import import_module
from typing import Any

from rems_net.errors import ExperimentError
from rems_net.gym.env import Given, RobotEnv
from rems_net.gym.library import Space
from rems_net.libraries import needed


class ParallelRobots:
    """Robots that act at the same time, each with its own action and observation.

    each: the settings of each robot, by its name: what it acts, observes, and its task.
    env: steps all of them.
    """

    metadata = {"render_modes": [], "name": "rems_net"}  # noqa: RUF012 - of PettingZoo

    def __init__(self, each: Mapping[str, Given], env: RobotEnv):
        self.possible_agents = [*each]
        self.agents: list[str] = []
        self._each, self._env = each, env
        self.observation_spaces = {k: one.observe.space for k, one in each.items()}
        self.action_spaces = {k: one.act.space for k, one in each.items()}
        self.units = {k: one.units for k, one in each.items()}

    def observation_space(self, agent: str) -> Space[Any]:
        """Return the space of one robot's observations."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Space[Any]:
        """Return the space of one robot's actions."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Begin an episode with all robots."""
        self._env.reset(seed=seed, options=options)
        self.agents = [*self.possible_agents]
        return self._observed(), {agent: {} for agent in self.agents}

    def step(
        self, actions: Mapping[str, Any]
    ) -> tuple[
        dict[str, Any],
        dict[str, float],
        dict[str, bool],
        dict[str, bool],
        dict[str, dict[str, Any]],
    ]:
        """Let all robots act that still take part; the others stand still."""
        if {*actions} != {*self.agents}:
            raise ExperimentError(
                f"actions are of {', '.join(actions) or 'no robot'}; expected one of "
                f"each of {', '.join(self.agents) or 'none: reset() begins'}. (R0927)"
            )
        before, taken = self._env.now, []
        for agent, one in self._each.items():
            if agent in actions:
                taken += one.act.take(actions[agent], clip=one.clip)
            else:
                taken += [schema() for schema in one.act.schemas.values()]
        cut = self._env.advance(taken)
        now = self._env.now
        some = {agent: self._each[agent] for agent in self.agents}
        judgements = {k: one.judged(now, before) for k, one in some.items()}
        rewards = {k: reward for k, (reward, _) in judgements.items()}
        ended = {k: ends for k, (_, ends) in judgements.items()}
        found = self._observed()
        infos: dict[str, dict[str, Any]] = {agent: {} for agent in some}
        self.agents = [] if cut else [k for k in self.agents if not ended[k]]
        return found, rewards, ended, dict.fromkeys(some, cut), infos

    def close(self) -> None:
        """Close the stage; a recording is complete then."""
        self._env.close()

    def _observed(self) -> dict[str, Any]:
        port = self._env.now.port
        return {
            agent: self._each[agent].observe.read(
                [port(key).leaves() for key in self._each[agent].observe.schemas]
            )
            for agent in self.agents
        }


def parallel(each: Mapping[str, Given], env: RobotEnv) -> ParallelRobots:
    """Return the robots as a ParallelEnv of PettingZoo, which has no types."""
    with needed("pettingzoo", "gym"):
        base = import_module("pettingzoo").ParallelEnv
    cls: type[ParallelRobots] = type("ParallelRobots", (ParallelRobots, base), {})
    return cls(each, env)
