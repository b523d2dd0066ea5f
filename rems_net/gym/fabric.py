"""OnFabric: the stage of an environment on a fabric, with agents in processes."""

import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from rems_net.agents.experiment.experiment import Experiment
from rems_net.agents.experiment.show import Show
from rems_net.agents.registry import check_starts
from rems_net.agents.verbs import outcome, request
from rems_net.defdict import DefDict
from rems_net.errors import AgentError
from rems_net.gym.offered import (
    Ports,
    Starts,
    beginnings,
    begins_by_verbs,
    with_starts,
)
from rems_net.router.mail import Mail, Mailbox
from rems_net.router.message import pack_stamp
from rems_net.router.session import Session

#: Number of ticks that no program makes: the environment ends its run.
ENDLESS = 2**40
#: s. A value that came later than this after its tick may be lost: it is asked for.
LATE = 0.02
#: s. An agent that has not answered for so long is given up.
PATIENCE = 10.0


class OnFabric:
    """A run of an experiment, each tick of which an environment makes.

    Programs see, record and stop it as any other run. A tick ends when all agents have
    done it.  ports: what is put and read.  ticks: of one step.  out: folder of the
    recording; None for `runs/<name>`.
    """

    def __init__(
        self, lab: Experiment, ports: Ports, ticks: int, out: Path | str | None = None
    ):
        self.lab, self.ports, self.ticks, self.out = lab, ports, ticks, out
        self._stack: ExitStack | None = None

    def begin(self, seed: int, starts: Starts) -> None:
        """Put everything back to its start, with this seed, as `Direct.begin` does."""
        if not begins_by_verbs(self.lab):
            self.close()
            with_starts(self.lab, starts)
            self.lab.seed = seed
            self._open()
        else:
            if self._stack is None:
                self._open()
            for key, initial in beginnings(self.lab, starts):
                words = request((), {"seed": seed, "initial": initial})
                outcome(key, self._answer(key, "@call", "reset", payload=words))
        self._values = [self._asked(key) for key in self.ports.observe]

    def step(self, actions: Sequence[DefDict]) -> None:
        """Put the actions at their Ins, and let them act for one step."""
        clock = self._clock
        stamp = pack_stamp(clock.tick.n, clock.tick.t)
        for put, action in zip(self._puts, actions, strict=True):
            put(action.encode(), attachment=stamp)  # the tick comes behind it
        clock.run(self.ticks)
        self._values = [self._newest(key) for key in self.ports.observe]

    def leaves(self) -> list[list[Any]]:
        """Return the leaves of each observed port, in schema order."""
        return [value.leaves() for value in self._values]

    def close(self) -> None:
        """End the run."""
        stack, self._stack = self._stack, None
        if stack is not None:
            stack.close()

    # -- for itself --------------------------------------------------------------

    def _open(self) -> None:
        lab = self.lab
        check_starts("reset() of an environment with fabric=True")
        lab.add_recorder()
        agents = lab.check()
        with ExitStack() as stack:
            going = lab.going(self.out, agents, ENDLESS, lab.pace, show=Show())
            self._clock = stack.enter_context(going).clock
            session: Session = self._clock.session
            self._session = session
            self._puts = [
                session.putting(session.key(key), f"{one.name}@{one.digest}")
                for key, one in self.ports.act.items()
            ]
            self._boxes = {key: Mailbox() for key in self.ports.observe}
            for key, box in self._boxes.items():
                session.watch(session.key(key), box)
            self._stack = stack.pop_all()

    def _newest(self, key: str) -> DefDict:
        """Return the value of the newest tick."""
        box, until = self._boxes[key], time.monotonic() + LATE
        while (left := until - time.monotonic()) > 0:
            mail = box.get(left)
            if isinstance(mail, Mail) and mail.stamp().n >= self._clock.tick.n:
                return self.ports.observe[key].decode(mail.payload)
        return self._asked(key)

    def _asked(self, key: str) -> DefDict:
        """Return the present value, by a question."""
        return self.ports.observe[key].decode(self._answer(key))

    def _answer(self, key: str, *parts: str, payload: bytes | None = None) -> bytes:
        """Ask an agent between two ticks. Raises AgentError if it does not answer."""
        full = self._session.key(key, *parts)
        answers = self._session.ask(full, payload, PATIENCE, first=True)
        if not answers:
            agent = "/".join(key.split("/")[:2])
            raise AgentError(agent, f"no answer within {PATIENCE:g} s. (R0522)")
        return answers[0].payload
