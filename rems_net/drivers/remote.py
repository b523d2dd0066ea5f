"""Remote: driver of a robot that stays in another fabric, found by its key.

A lease ensures that no other program commands the robot meanwhile. The robot's own
fabric keeps it safe: it stands still if this driver is frozen, killed or cut off, and
at STOP of either fabric.
"""

from collections.abc import Callable
from contextlib import suppress
from secrets import randbelow

from rems_net.agents.about.standing import SENT, Standing, read_standing
from rems_net.agents.ports import Settings
from rems_net.agents.runtime import runtime
from rems_net.agents.verbs import request
from rems_net.defdict import Converter, DefDict, Schema, text
from rems_net.drivers.hardware.device_thread import Readings
from rems_net.drivers.hardware.driven import Driven, NoDeviceError
from rems_net.errors import (
    AgentError,
    DeniedError,
    FabricError,
    RemsError,
    SchemaError,
    WireError,
    nearest,
    some,
    uncoded,
)
from rems_net.router import find
from rems_net.router.asking import printable
from rems_net.router.gate.access import is_of_team
from rems_net.router.gate.identity import identity
from rems_net.router.gate.stops import ask_who_stopped, read_said
from rems_net.router.keys import FABRIC, is_name
from rems_net.router.mail import Mail
from rems_net.router.message import BADGES, Stamp, machine, pack, pack_stamp, read
from rems_net.router.session import Session

#: s. If the robot's fabric has not answered for this long, the robot counts as lost.
ANSWER_TIMEOUT = 2.0
#: s. At the end we wait this long for the answer; other agents wait for our exit.
FAREWELL = 0.3
#: characters of a holder's name; a board has room for this many
HOLDER = 100
#: exchanges between two claims of the lease: four claims in the time that it lasts
CLAIM = 12
#: exchanges between two questions whether it stands, while STOP holds here
ASK = 4
#: STOP is published repeatedly: it is reported once in this many exchanges; and s: its
#: source is reported only if STOP is newer than this.
STOPS, JUST = 100, 2.0


class Remote(Driven):
    """A robot of another fabric, or one outside this run.

    It runs by `rems agent start robot`, in another run, or by its own firmware, and
    stays there. It obeys the commands of the robot here, which has its state and
    sensors.
    """

    options = Settings(
        key=text(doc="rems/robot/woodbot-7; its name here, on fabric rems, if empty"),
        at=text(
            doc="its router, 192.168.1.20; that of `rems router use`, or here, if empty"
        ),
    )

    _key = ""
    _session: Session | None = None
    #: number in the stamps of its commands; no other program has the same
    _badge = 0
    _is_reset = False
    #: who has taken the robot back from this run, and whether that was reported
    _taker = ""
    _is_told = False
    #: whether the robot has published its safe command since its last other command
    _echo_is_safe = True
    #: what the robot's own host knows of its standing still
    _theirs = SENT
    _put: Callable[..., None]
    _command: Converter
    _outs: dict[str, Converter]

    # -- called by the host ------------------------------------------------------

    def prepare(self) -> None:
        super().prepare()
        self._key = str(self.options.key) or f"{FABRIC}/{self.key}"
        fabric, *agent = self._key.split("/")
        if agent[:1] != ["robot"] or [*map(is_name, (fabric, *agent))] != [True] * 3:
            raise SchemaError(
                f"key is {self._key!r}; expected a fabric and its robot, such as "
                'options = { key = "rems/robot/woodbot-7" }. (R0309)'
            )

    def rewind(self) -> None:
        """Reset the robot in its own fabric, to that fabric's initial pose."""
        if self._session is not None:
            self.perform(self._reset_there, ANSWER_TIMEOUT)
        super().rewind()

    def is_still(self) -> bool:
        """Return whether the robot obeys its safe command; ask what it is sure of."""
        session = self._session
        asks = self._echo_is_safe and runtime(self).held and self._count % ASK == 0
        if asks and session is not None:
            session.ask_at_once(f"{self._key}/@stopped", self._hear_standing)
        return self._echo_is_safe

    @property
    def standing(self) -> Standing:
        here = super().standing
        return self._theirs if here.kind == "confirmed" else here

    @property
    def stops_alone(self) -> float | None:
        return self.max_age  # its own host stops it then

    # -- run in the device thread ------------------------------------------------

    def connect(self) -> None:
        """Find the robot, compare its ports with ours, and get its lease."""
        self._badge = self._badge or 1 + randbelow(BADGES - 1)
        self._holder = ascii(f"{self.key} of {machine()}")[1:-1][:HOLDER]
        #: exchanges in all, and since the last answer of the robot's fabric
        self._count = self._silent = 0
        #: newest message of each port since the last exchange; the newest state's stamp
        self._news: dict[str, tuple[Mail, Stamp]] = {}
        self._stamp: Stamp | None = None
        try:
            self._session = session = self._find()
            command = self._compare(session)
            for mail in session.ask(
                *self._claim(self._holder), ANSWER_TIMEOUT, first=True
            ):
                self._granted(mail)
            if not (self._is_reset or self._taker):
                self._reset_there()
        except DeniedError as error:
            raise AgentError(
                self.key,
                f"{uncoded(error)} For you to drive {self._key}, a teacher brings that "
                "robot to the class's fabric: rems agent start robot DEFINITION DRIVER "
                f"--name {self._key.rpartition('/')[2]} (R0310)",
            ) from None
        except FabricError as error:
            raise NoDeviceError(uncoded(error)) from None
        self._is_reset, self._safe = True, command()
        key, named = f"{self._key}/command", f"{command.name}@{command.digest}"
        self._put = session.putting(key, named, block=False, remote=True)
        for port in ("command", *self._outs):
            session.watch_at_once(f"{self._key}/{port}", self._hear)
        self._stop_at = -1 - STOPS
        session.watch_at_once(f"{self._key.partition('/')[0]}/stop", self._hear_stop)

    def _find(self) -> Session:
        """Join the robot's fabric; of several routers here, the one with the robot."""
        fabric, at = self._key.partition("/")[0], str(self.options.at)
        session = find.open_session(fabric, at)
        if not at and not find.chosen():
            for other in find.others(session):
                if session.who(f"{self._key}/@alive"):
                    break
                session.close()
                session = find.open_session(fabric, other)
        return session

    def _compare(self, session: Session) -> Schema:
        """Return the schema of the robot's command; prepare to convert all ports.

        Raises FabricError if the robot is not there, SchemaError or ConversionError if
        its ports differ from ours.
        """
        told = session.ask(f"{self._key}/@schema", None, ANSWER_TIMEOUT, first=True)
        if not told:
            raise FabricError(self._absent(session))
        wires = read(told[0].payload)
        theirs = {str(port): Schema.from_wire(wire) for port, wire in wires.items()}
        ours = self.published()
        if missing := sorted(ours.keys() - theirs.keys()):
            raise SchemaError(
                f"{self._key} has no {missing[0]}, but {self.key} needs it. (R0310)"
            )
        here, there = self.key, self._key
        self._command = ours.pop("command").converter(
            theirs["command"], source_label=here, target_label=there
        )
        self._outs = {
            port: theirs[port].converter(mine, source_label=there, target_label=here)
            for port, mine in ours.items()
        }
        return theirs["command"]

    def _absent(self, session: Session) -> str:
        """Return the error's message: robots that are there, and how to bring one."""
        fabric, _, name = self._key.split("/")
        seen = [key.split("/")[2] for key in session.who(f"{fabric}/robot/*/@alive")]
        there = sorted(name for name in seen if is_name(name))
        if name in there:
            return (
                f"{self._key} is there, and has not answered for {ANSWER_TIMEOUT:g} s: "
                "it is frozen or cut off. Start it anew where it runs, or take another "
                "robot. (R0310)"
            )
        known, bring = identity(session), "type"
        if known is not None and known.team and not is_of_team(known.team, fabric):
            bring = "a teacher types"
        hint = nearest(name, there) or f" Robots there: {some(there)}."
        return (
            f"there is no robot/{name} on {fabric!r} at {session.link.endpoint}.{hint} "
            f"To bring it, {bring}: rems agent start robot DEFINITION DRIVER --name "
            f"{name} --fabric {fabric} (R0310)"
        )

    def _claim(self, holder: str) -> tuple[str, bytes]:
        """Return the request for the lease; without a holder, the request to end it."""
        return f"{self._key}/@lease", pack((self._badge, holder))

    def exchange(self, command: DefDict) -> Readings | None:
        """Publish the command with the newest state's stamp, and return new values."""
        session = self._session
        if session is None:
            raise OSError("not connected")
        if self._is_told:
            return None  # the lease has ended: another program may drive it
        if self._taker:
            self._is_told = True
            raise AgentError(
                self.key,
                f"{self._key} was taken back by {self._taker}. Start this run anew "
                "when you may have that robot again. (R0310)",
            )
        self._count += 1
        self._silent += 1
        if self._silent > self.rate * ANSWER_TIMEOUT:
            raise OSError(f"{self._key} has not answered for {ANSWER_TIMEOUT:g} s")
        if self._count % CLAIM == 0:
            key, claim = self._claim(self._holder)
            session.ask_at_once(key, self._granted, ANSWER_TIMEOUT, claim)
        came = {port: self._news.pop(port, None) for port in self._outs}
        if newest := came.get("state"):
            self._stamp = newest[1]
        if self._stamp is not None:
            told = self._command(command)
            if told != self._safe:
                self._echo_is_safe, self._theirs = False, SENT
            stamp = pack_stamp(self._stamp.n, self._stamp.t, self._badge)
            self._put(told.encode(), attachment=stamp)
        try:
            return {
                port: self._outs[port].decode(one[0].payload)
                for port, one in came.items()
                if one is not None
            }
        except RemsError as error:
            raise WireError(f"a value of {self._key}: {error}") from None

    def disconnect(self) -> None:
        """Give the lease back, and close the session."""
        session, self._session = self._session, None
        if session is not None:
            with suppress(FabricError):
                session.ask(*self._claim(""), FAREWELL, first=True)
            session.close()

    def _reset_there(self) -> None:
        if self._session is not None:
            key = f"{self._key}/@call/reset"
            self._session.ask(key, request((), {}), ANSWER_TIMEOUT, first=True)
            self._news.clear()

    # -- in threads of the session -----------------------------------------------

    def _granted(self, mail: Mail) -> None:
        self._silent = 0
        with suppress(RemsError):
            said = read(mail.payload)
            if isinstance(said, str):
                self._taker = printable(said)

    def _hear_stop(self, mail: Mail) -> None:
        """Ask who pressed STOP on the robot's fabric, once for each STOP."""
        session = self._session
        if session is not None and self._count - self._stop_at > STOPS:
            self._stop_at = self._count
            ask_who_stopped(session, self._tell_stop, mail.key.partition("/")[0])

    def _tell_stop(self, mail: Mail) -> None:
        with suppress(RemsError):
            said = read_said(mail.payload)
            if said.ago < JUST:
                self.note(f"stands: {said.on(self._key.partition('/')[0])}")

    def _hear_standing(self, mail: Mail) -> None:
        with suppress(RemsError):
            theirs = read_standing(read(mail.payload))
            self._theirs = theirs if self._echo_is_safe else SENT

    def _hear(self, mail: Mail) -> None:
        """Keep the newest value of a port."""
        with suppress(RemsError):  # any program can publish anything there
            stamp, port = mail.stamp(), mail.key.rpartition("/")[2]
            if port != "command":
                self._news[port] = mail, stamp
            elif stamp.badge != self._badge and not self._echo_is_safe:
                obeyed = self._safe.schema.decode(mail.payload)
                self._echo_is_safe = obeyed == self._safe
