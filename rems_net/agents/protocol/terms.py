"""Terms: what a run is, agreed before it starts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from rems_net.agents.protocol.limits import PATIENCE


@dataclass(frozen=True, slots=True)
class Terms:
    """What a run is: its time, and who takes part.

    dt: seconds of a tick       ticks: how many
    pace: real-time factor, 0.0 for as fast as the slowest host
    hosts: the agents (`robot/sim`) of each host that takes part, wherever it is
    started; nobody else may join. Without any, everybody may.
    tickets: what each host that is started here proves itself with
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
    restarts: Mapping[str, int] = field(default_factory=dict)
    drop: bool = False
    patience: float = PATIENCE
    catch_up: bool = False
    open: bool = False
