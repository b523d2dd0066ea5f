"""STOP from outside: it is put first, and then asked who stands.

The clock is not asked: it may be frozen or gone, and the robots stop without it.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from threading import Event
from typing import Any

from rems_net.errors import FabricError, WireError
from rems_net.fabric.client import Client, Gathered, named
from rems_net.router.mail import Mail
from rems_net.router.message import pack, read
from rems_net.router.session import Session

#: seconds after which who has not answered is named
SOON = 0.25
#: seconds after which nobody is asked again
LAST = 1.0
#: seconds the answers to the first question may take; each that follows waits twice
#: as long, so that a slow network has its time, too
ROUND = 0.05
PAUSE = 0.01


@dataclass(frozen=True, slots=True)
class Receipt:
    """What a robot says about STOP. `tick` is -1 where it has not said anything.

    robot: `robot/sim`     stands: whether it obeys, and stands still
    tick, time: since when it stands, or the newest that it has done [s of fabric time]
    """

    robot: str
    stands: bool = False
    tick: int = -1
    time: float = 0.0

    def __str__(self) -> str:
        when = f"tick {self.tick} ({self.time:.2f} s)"
        if self.stands:
            return f"{self.robot} stands since {when}"
        if self.tick >= 0:
            return f"{self.robot} does not stand yet at {when}"
        return f"{self.robot} has not answered"


def stop_each(session: Session, fabrics: list[str]) -> None:
    """Put STOP on each of these fabrics, and wait for nobody."""
    for name in fabrics:
        session.put(session.on(name).key("stop"), pack(True))


def stop(client: Client) -> list[Receipt]:
    """Stop every robot: a receipt of each that is there, by name.

    Returns when all stand, or after LAST seconds. Raises FabricError where there is no
    robot at all.
    """
    key = client.session.key
    begun = time.monotonic()
    said: dict[str, Receipt] = {}
    met: set[str] = set()  # one that freezes meanwhile is soon out of sight, and counts
    named_them = False
    length = ROUND
    while True:
        # Again and again: a router that has just come back may not have passed it on.
        client.session.put(key("stop"), pack(True))
        here = {a for a in client.alive() if a.startswith("robot/")}
        met |= here
        ends = begun + (LAST if named_them else SOON)
        said |= _ask(client, here, min(time.monotonic() + length, ends))
        if here and all(a in said and said[a].stands for a in here):
            break
        now = time.monotonic()
        if now > begun + LAST:
            break
        if now > begun + SOON and not named_them:
            named_them = True
            if silent := sorted(here - said.keys()):
                client.tell(f"{named(silent)} has not answered within {SOON:g} s")
        length *= 2
        Event().wait(PAUSE)
    if not met:
        raise FabricError(
            f"At {client.session.link.endpoint}: there is no robot to stop. Who is "
            "there is told by `rems list`."
        )
    return [said.get(a, Receipt(a)) for a in sorted(met)]


def _ask(client: Client, here: set[str], until: float) -> dict[str, Receipt]:
    """What the robots say, until all that are here have said something."""
    gathered = Gathered(_read_receipt)
    asked = client.session.key("robot", "*", "@stopped")
    with client.session.asking(asked, None, LAST) as asking:
        missing = set(here)
        while (missing or not here) and gathered.take(asking, until) is not None:
            missing -= {receipt.robot for receipt in gathered.values.values()}
    said = {receipt.robot: receipt for receipt in gathered.values.values()}
    return {agent: said[agent] for agent in here & said.keys()}


def _read_receipt(mail: Mail) -> Receipt:
    plain: Any = read(mail.payload)
    tick, when = plain["tick"], plain["time"]
    stopped, stands = plain["stopped"], plain["stands"]
    if type(tick) is not int or tick < 0 or type(stands) is not bool:
        raise WireError("it is no receipt")
    if type(when) not in (int, float) or not math.isfinite(when):
        raise WireError("it is no receipt")
    robot = "/".join(mail.key.split("/")[1:3])
    return Receipt(robot, stands and stopped is True, tick, float(when))


def release(client: Client) -> list[str] | bool:
    """Let the robots obey again: those that the clock has released, by name.

    Where there is no clock, the router that holds the STOP is asked: whether it did.
    Raises FabricError where nobody keeps a STOP.
    """
    if client.is_there("clock"):
        released: Any = client.call("clock", "release", (), {})
        return [str(a) for a in released] if isinstance(released, list) else []
    with client.session.asking(client.session.key("stop", "@release")) as asking:
        gathered = Gathered(_read_released)
        if gathered.take(asking, time.monotonic() + LAST) is not None:
            return any(gathered.values.values())
    raise FabricError(
        f"At {client.session.link.endpoint}: nobody keeps a STOP. No experiment runs "
        "there, and the router is none of `python -m rems_net.router`."
    )


def _read_released(mail: Mail) -> bool:
    held = read(mail.payload)["released"]
    if type(held) is not bool:
        raise WireError("it is no receipt")
    return held
