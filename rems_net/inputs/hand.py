"""Inputs that people move: a stick, or the keys of a keyboard."""

from rems_net.agents.agent import Input
from rems_net.agents.ports import In, Out
from rems_net.agents.robot import be_safe
from rems_net.agents.runtime import runtime
from rems_net.agents.tick import Tick
from rems_net.defdict import DefDict
from rems_net.teleop.keys import KEYBOARD
from rems_net.teleop.stick import STICK


class HandInput(Input):
    """A stick that a person moves, in a terminal or on a page.

    `rems drive input/NAME` moves it. It drives wheels and velocities by itself; for
    other commands, write a process with a rule. Its experiment needs a pace, such as 1.
    """

    by_hand = True
    command = In(STICK)
    value = Out(STICK)
    #: s. A hand that was not reported for longer is gone: the stick is at rest.
    max_age = 0.5

    def read(self, tick: Tick) -> DefDict:
        """Return what the hand does now: at rest at STOP, or if nobody is there."""
        run = runtime(self)
        if run.must_stand(run.command_age(tick), self.max_age):
            be_safe(self)
        return self.command


class KeyboardInput(HandInput):
    """The keys that a person holds down, in a terminal or on a page.

    `rems drive input/NAME` reports them. They drive robots as a stick does: up and down
    or w and s, turning by left and right or a and d, sideways by q and e.
    """

    command = In(KEYBOARD)
    value = Out(KEYBOARD)
