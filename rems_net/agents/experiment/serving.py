"""Serving: an open fabric, which never ends and waits for nobody."""

from __future__ import annotations

from collections.abc import Callable

from rems_net.agents.clock.clock import Clock
from rems_net.agents.protocol.terms import Terms
from rems_net.errors import ExperimentError
from rems_net.router.message import LAST_TICK
from rems_net.router.session import Session


def serve(
    session: Session,
    dt: float,
    pace: float,
    begin: Callable[[Clock], None] = lambda clock: None,
) -> None:
    """Be the clock of this session's fabric, for ever. Raises FabricError.

    dt: seconds of a tick.  pace: real-time factor, above 0.
    begin: called once it ticks.
    """
    if not pace > 0:
        raise ExperimentError(
            "an open fabric waits for nobody, so it can't be as fast as the slowest; "
            "expected a pace above 0, such as 1."
        )
    clock = Clock(session, Terms(dt, LAST_TICK, pace, open=True))
    clock.open()
    begin(clock)
    try:
        clock.gather()
        clock.run(LAST_TICK)
    finally:
        clock.release(0.0)
