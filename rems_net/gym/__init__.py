"""Environments: an experiment as an environment for reinforcement learning.

import rems_net.gym

env = rems_net.gym.make(
    "lab.toml", act="robot/sim/command", observe="robot/sim/state",
    reward="x", ends="x > 1 m", limit="20 s")
observation, info = env.reset(seed=3)

It needs `pip install "rems-net[gym]"`. gymnasium.make("rems_net.gym:rems_net/Lab-v0",
lab="lab.toml", ...) makes the same environment.
"""

from contextlib import suppress
from importlib import import_module
from typing import TYPE_CHECKING

from rems_net.doors import door

if TYPE_CHECKING:
    from rems_net.gym.making import make as make, make_parallel as make_parallel
    from rems_net.gym.task import Moment as Moment, Task as Task

__getattr__, __dir__ = door(__name__)

# gymnasium.make("rems_net.gym:rems_net/Lab-v0") imports this module, to find the name.
# Without gymnasium, the first use of a name here gives the reason.
with suppress(ImportError):
    import_module("rems_net.gym.library")
