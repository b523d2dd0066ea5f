"""Leases: a robot obeys the run elsewhere, or the person, that has its lease."""

from collections import deque
from typing import NamedTuple

from rems_net.agents.agent import Agent
from rems_net.agents.protocol.badge import run_of
from rems_net.agents.protocol.messages import read_claim
from rems_net.agents.robot import be_safe, takes_commands
from rems_net.agents.wall import wall
from rems_net.engine.inlet import Inlet
from rems_net.errors import RemsError, WireError
from rems_net.events import info, warn
from rems_net.router.mail import Mail, Question
from rems_net.router.message import Stamp, pack

#: s. A lease ends if its holder does not renew it in this time: twice as long as a
#: command is obeyed, so that the robot stands before another run may have it.
LENGTH = 1.0
#: s. A person who asks for a robot that another person drives has it after this time.
HANDOVER = 5.0
#: Number of remembered leases that were taken away: their holders ask once more.
TAKEN = 64


class Lease(NamedTuple):
    """The right to command one robot.

    badge: in the stamps of the holder's commands.  holder: its name, for people. until:
    wall time of its end [s].  person: whether a person drives, who hands it over.
    """

    badge: int
    holder: str
    until: float
    person: bool = False


class Request(NamedTuple):
    """A person's request for a robot that another person drives.

    since, until: wall time [s]; it ends if it is not repeated.
    """

    badge: int
    holder: str
    since: float
    until: float


class Leases:
    """The leases of the robots of one host."""

    def __init__(self) -> None:
        #: by key of the In, the newest value of a program outside
        self.given: dict[str, tuple[Mail, Stamp]] = {}
        #: robots and inputs here that take commands, by key, each with its source
        self._robots: dict[str, tuple[Agent, str | None]] = {}
        self._leases: dict[str, Lease] = {}
        #: by robot, the newest request
        self._requests: dict[str, Request] = {}
        #: robot, badge of the run that has lost it, and the name of the taker
        self._taken: deque[tuple[str, int, str]] = deque(maxlen=TAKEN)

    def declare(self, inlets: list[Inlet]) -> None:
        """Add the robots and inputs whose commands these Ins are."""
        for inlet in inlets:
            if inlet.port == "command" and takes_commands(inlet.agent):
                self._robots[inlet.agent.key] = inlet.agent, inlet.source

    def check(self, robot: str, badge: int, run: int) -> None:
        """Raise WireError if a command with this badge must not be obeyed.

        run: of which the robot is a member. A badge of no run and no lease is that of a
        lease that has ended.
        """
        lease = self._leases.get(robot)
        if lease is not None:
            if badge != lease.badge:
                raise WireError(
                    f"{robot} is leased to {lease.holder} for now; wait, or take "
                    "another robot. (R0619)"
                )
        elif badge and run_of(badge) != run:
            raise WireError(
                "its stamp is of a lease that has ended, or of no run. (R0621)"
            )

    def holder(self, robot: str) -> str:
        """Return the holder of the robot's lease; "" if there is none."""
        lease = self._leases.get(robot)
        return "" if lease is None else lease.holder

    def holders(self) -> dict[str, str]:
        """Return the holder of each lease, by robot. For any thread."""
        return {robot: lease.holder for robot, lease in [*self._leases.items()]}

    def look(self) -> None:
        """End the leases that were not renewed."""
        for robot, lease in [*self._leases.items()]:
            if lease.until < wall():
                self._end(robot, "it was not asked for again in time")

    def answer(self, question: Question, robot: str) -> None:
        """Grant a lease, renew it or end it, as the question wants; or refuse.

        A question at `@lease/take` takes it away from its holder. A router with users
        accepts it only from a user to whom the fabric belongs. One at `@lease/drive` is
        of a person, who has the robot after HANDOVER seconds if another person has it.
        """
        last = question.key.rpartition("/")[2]
        ways = {"take": self._take, "drive": self._drive}
        grant = ways.get(last, self._grant)
        try:
            said = grant(robot, question.payload)
        except RemsError as error:
            question.refuse(str(error))
        else:
            question.answer(question.key, pack(said))

    def _take(self, robot: str, payload: bytes) -> str:
        """End the lease of a robot. Return its holder; "" if there is none."""
        by, holder = read_claim(payload).holder, self.holder(robot)
        if not by:
            raise WireError("nobody takes it; expected [1, the taker's name]. (R0621)")
        if holder:
            self._taken.append((robot, self._leases[robot].badge, by))
            self._end(robot, f"it was taken back by {by}")
        return holder

    def _drive(self, robot: str, payload: bytes) -> float | str | list[object]:
        """Return as `_grant`; or a list, if two people want the robot.

        To the driver: ["wanted", the other person, seconds left]. To the other:
        ["driven", the driver, seconds left].
        """
        claim, now = read_claim(payload), wall()
        self.look()
        lease, request = self._leases.get(robot), self._requests.get(robot)
        if request is not None and request.until < now:
            request = self._requests.pop(robot) and None
        if claim.holder and lease and lease.person and lease.badge != claim.badge:
            if request is None or request.badge != claim.badge:
                request = Request(claim.badge, claim.holder, now, now)
            self._requests[robot] = request = request._replace(until=now + LENGTH)
            if (left := request.since + HANDOVER - now) > 0:
                return ["driven", lease.holder, left]
            self._taken.append((robot, lease.badge, claim.holder))
            self._end(robot, f"it was handed over to {claim.holder}")
        said = self._grant(robot, payload, person=True)
        if isinstance(said, str) or not claim.holder:
            return said
        if request is not None and request.badge != claim.badge:
            return ["wanted", request.holder, request.since + HANDOVER - now]
        self._requests.pop(robot, None)
        return said

    def _grant(self, robot: str, payload: bytes, person: bool = False) -> float | str:
        """Return the length of the lease [s], or the name of the person who took it."""
        claim = read_claim(payload)
        for taken, badge, by in self._taken:
            if (taken, badge) == (robot, claim.badge):
                return by
        agent, source = self._robots[robot]
        tick = agent.tick
        self.look()
        lease = self._leases.get(robot)
        if source is not None:
            raise WireError(
                f"{source} commands {robot} there; no other program can. (R0619)"
            )
        if tick.n and not tick.pace:
            raise WireError(
                "its run is as fast as it can be, so commands from elsewhere come too "
                "late; give that run a pace: --pace 1 (R0619)"
            )
        if lease is not None and lease.badge != claim.badge:
            wait = "they let go" if lease.person else "that run has ended"
            raise WireError(
                f"{robot} is leased to {lease.holder}; wait until {wait}, "
                "or take another robot. A teacher takes it back by: rems stop "
                f"{robot} (R0619)"
            )
        if not claim.holder:
            if lease is not None:
                self._end(robot, "it was given back")
            return LENGTH
        if lease is None:
            if person:
                info("lease", f"{claim.holder} drives it", robot)
            else:
                warn("lease", f"{robot} is leased to {claim.holder}", robot)
            self._stand(robot)
        until = wall() + LENGTH
        self._leases[robot] = Lease(claim.badge, claim.holder, until, person)
        return LENGTH

    def _end(self, robot: str, why: str) -> None:
        lease = self._leases.pop(robot)
        self._stand(robot)
        if lease.person:
            info("lease", f"{lease.holder} drives it no more: {why}", robot)
        else:
            ended = f"{robot} is no longer leased to {lease.holder}: {why}"
            warn("lease", ended, robot)

    def _stand(self, robot: str) -> None:
        """Make the robot obey its safe command; no earlier command counts."""
        self.given.pop(f"{robot}/command", None)
        agent, _ = self._robots[robot]
        be_safe(agent)
