"""Terms: the settings of a run, fixed before it starts."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from rems_net.agents.protocol.limits import JOIN_TIME, WAIT_BACK, WAIT_START
from rems_net.defdict import Schema


class Wait(NamedTuple):
    """How long a run waits for other machines.

    start: s, for hosts to join, counted from the last one that did.
    back: s, for a member that is out of sight.
    """

    start: float = WAIT_START
    back: float = WAIT_BACK


@dataclass(frozen=True, slots=True)
class Terms:
    """Settings of a run: its time, and its members.

    dt: seconds of a tick       ticks: how many
    pace: real-time factor, 0.0 for as fast as the slowest host
    hosts: the agents (`robot/sim`) of each host that takes part, on any machine; no
    other host may join. If empty, any host may.
    tickets: by host, the number by which a host that this run started proves it
    machines: by host, the machine (`b`) that is to bring it
    outs: of agents that are started elsewhere, the ports as they are defined here
    wait: for hosts that have to join, or have to come back
    restarts: how often a host that crashed may be started again
    drop: whether the run goes on without a member that fails
    open: the run never ends, waits for no host, and any host may come and go
    """

    dt: float
    ticks: int = 0
    pace: float = 0.0
    hosts: Mapping[str, frozenset[str]] = field(default_factory=dict)
    tickets: Mapping[str, int] = field(default_factory=dict)
    machines: Mapping[str, str] = field(default_factory=dict)
    outs: Mapping[str, Mapping[str, Schema]] = field(default_factory=dict)
    wait: Wait = field(default=Wait(JOIN_TIME))
    restarts: Mapping[str, int] = field(default_factory=dict)
    drop: bool = False
    open: bool = False
