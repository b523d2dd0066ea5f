"""Terms: what a run is, agreed before it starts."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from rems_net.agents.protocol.limits import JOIN_TIME, PATIENCE
from rems_net.defdict import Schema


@dataclass(frozen=True, slots=True)
class Terms:
    """What a run is: its time, and who takes part.

    dt: seconds of a tick       ticks: how many
    pace: real-time factor, 0.0 for as fast as the slowest host
    hosts: the agents (`robot/sim`) of each host that takes part, wherever it is
    started; nobody else may join. Without any, everybody may.
    tickets: what each host that is started here proves itself with
    machines: by host, the machine (`b`) that shall bring it
    outs: of agents that are started elsewhere, the ports as they are defined here
    wait: seconds that hosts have to join, from the last that did
    restarts: how often a host that crashed may be started again
    drop: whether it goes on without a member that fails
    patience: seconds a member may be out of sight
    open: it never ends, waits for nobody, and everybody may come and go
    catch_up: whether a late run at a pace hurries until it is in time again
    """

    dt: float
    ticks: int = 0
    pace: float = 0.0
    hosts: Mapping[str, frozenset[str]] = field(default_factory=dict)
    tickets: Mapping[str, int] = field(default_factory=dict)
    machines: Mapping[str, str] = field(default_factory=dict)
    outs: Mapping[str, Mapping[str, Schema]] = field(default_factory=dict)
    wait: float = JOIN_TIME
    restarts: Mapping[str, int] = field(default_factory=dict)
    drop: bool = False
    patience: float = PATIENCE
    catch_up: bool = False
    open: bool = False
