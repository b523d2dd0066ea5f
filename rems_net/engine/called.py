"""Calls: a process's calls of a robot's verbs, done before the robot's next step."""

from collections.abc import Mapping

from rems_net.agents.agent import Agent
from rems_net.agents.diagnosis import describe, placed
from rems_net.agents.tick import Tick
from rems_net.agents.verbs import CALLED, CALLS, Call, call, read_calls, verbs_of
from rems_net.engine.inlet import Inlet
from rems_net.engine.source import Value
from rems_net.errors import AgentError, RemsError


class Calls(Inlet):
    """The calls of one process for one robot, received at every tick.

    A robot that steps at every k-th tick does all calls since its last step.
    """

    def __init__(self, robot: Agent, source: str, here: Mapping[str, Agent]):
        super().__init__(robot, f"{CALLED}/{source}", source, here, CALLS)
        self.every = 1  # it receives calls when the robot does not step, too
        self._due: list[Call] = []
        self._came: Value | None = None
        self.forget()

    def forget(self) -> None:
        """Forget the calls of a clock that is gone."""
        self._due.clear()
        #: the newest tick whose calls are known; -1 before the first
        self._known, self._said = -1, ""

    def fill(self, tick: Tick) -> None:
        """Receive the new calls, and do all of them if the robot steps at this tick."""
        if self._known < 0:  # the process repeats its earlier calls
            self._known = tick.n - 2
        super().fill(tick)
        if self._came is not None:
            try:
                self._receive(self._came[0]["calls"])
            except RemsError as error:  # the program writes calls in another form
                self._drop(str(self.source), error, tick)
            self._came = None
        if not tick.n % self.run.every:
            while self._due:
                self._do(self._due.pop(0), tick)

    def _store(self, key: str, came: Value) -> None:
        self._came = came

    def _receive(self, said: str) -> None:
        if said == self._said:
            return
        new = [one for one in read_calls(said) if one.n > self._known]
        self._said = said
        self._due += [one for one in new if one.robot == self.agent.key]
        self._known = max((one.n for one in new), default=self._known)

    def _do(self, one: Call, tick: Tick) -> None:
        """Call the verb. Raises AgentError of the process, with the line of the call.

        On an open fabric, and for a robot that lives in real time, it is a warning.
        """
        try:
            call(verbs_of(self.agent), one.verb, one.args, one.kwargs)
        except (Exception, SystemExit) as error:
            said = describe(error) if not isinstance(error, RemsError) else str(error)
            said = placed(
                f"{one.robot}.{one.verb}(): {said}", f"{one.line}, tick {one.n}"
            )
            assert self.source is not None
            if self.run.in_step:
                process = "/".join(self.source.split("/")[:2])
                raise AgentError(process, said) from error
            self._warn("rejected", f"refused a call: {said}", tick.n)
