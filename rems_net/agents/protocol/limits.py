"""Limits that the clock and its hosts share."""

from __future__ import annotations

#: How many ticks a fast clock is ahead of its slowest host. Values carry their ticks,
#: so nobody reads anything else than in single file; and nobody waits for the clock.
AHEAD = 8
#: seconds it may take to let an agent in, of which a host may have thousands
JOIN_TIME_EACH = 0.02
