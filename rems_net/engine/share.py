"""Ins of which agents have no attribute: shares of a command, and poses of ghosts."""

from collections.abc import Mapping

from rems_net.agents.agent import PHASES, Agent
from rems_net.agents.rules import given_part, shared
from rems_net.defdict import Schema, changed, lock
from rems_net.engine.inlet import Inlet
from rems_net.engine.source import Value
from rems_net.scenes.description import FOLLOWED, POSE


class Share(Inlet):
    """The fields of a robot's command that one of several agents writes.

    They have their own age: `Robot.obey` makes them safe when they are too old.
    """

    def __init__(self, robot: Agent, port: str, source: str, here: Mapping[str, Agent]):
        self._whole = port.partition("/")[0]
        super().__init__(robot, port, source, here, robot.__dict__[self._whole].schema)
        self.key = f"{robot.key}/{self._whole}"
        self.run.shares[port] = {}
        lock(self._own[self._whole], self._refuse)

    def _wanted(self, theirs: Schema) -> Schema:
        assert self.schema is not None
        rules = self.run.rules
        part = shared(self.schema, theirs, rules, self.key, str(self.source))
        self.run.shares[self.port] = part().flat()
        return part

    def _store(self, key: str, came: Value) -> None:
        value, self.run.source_ticks[self.port] = came
        self._own[self._whole] = changed(self._own[self._whole], value.flat())


class Trail(Inlet):
    """The pose of one ghost of a world, which is read before its robots step.

    So they sense the ghost one tick after its pose was written.
    """

    def __init__(self, world: Agent, port: str, source: str, here: Mapping[str, Agent]):
        super().__init__(world, port, source, here, FOLLOWED)
        self.phase = PHASES.index("robot")

    def _wanted(self, theirs: Schema) -> Schema:
        return given_part(FOLLOWED, theirs, self.run.rules, POSE)
