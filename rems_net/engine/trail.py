"""Trail: the pose that a ghost of a world follows."""

from collections.abc import Mapping

from rems_net.agents.agent import PHASES, Agent
from rems_net.agents.rules import Rules, given_paths
from rems_net.defdict import Schema
from rems_net.engine.inlet import Inlet
from rems_net.scenes.description import FOLLOWED, POSE


def followed(theirs: Schema, rules: Rules) -> Schema:
    """Return the fields of a pose that a port gives, and those that it needs."""
    given = given_paths(theirs, FOLLOWED, rules)
    return FOLLOWED.slice(*(p for p in FOLLOWED.paths if p in given or p in POSE))


class Trail(Inlet):
    """The pose of one ghost.

    It is read before the world's robots step, as their commands are, so that they sense
    the ghost one tick after its pose was written.
    """

    def __init__(self, world: Agent, port: str, source: str, here: Mapping[str, Agent]):
        super().__init__(world, port, source, here, FOLLOWED)
        self.phase = PHASES.index("robot")

    def _wanted(self, theirs: Schema) -> Schema:
        return followed(theirs, self.run.rules)
