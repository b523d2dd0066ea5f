"""The device thread: serves one device at its rate, in wall time."""

from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from contextlib import suppress
from math import inf
from threading import Event, Thread
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from rems_net.agents.about.standing import SENT, Standing
from rems_net.agents.diagnosis import describe, where
from rems_net.agents.runtime import runtime
from rems_net.agents.wall import wall
from rems_net.defdict import DefDict
from rems_net.drivers.hardware.periodic import Periodic
from rems_net.drivers.hardware.watchdog import Motion, Watchdog
from rems_net.errors import FieldValueError, SchemaError, WireError, nearest

if TYPE_CHECKING:
    from rems_net.drivers.hardware.driven import Driven

#: s. Wait between two attempts to connect: the first, and the longest.
BACK_OFF = (0.1, 0.5)
#: s. After a connection of this length, the wait is the shortest one again.
HELD = 2.0
#: s. A robot that is stopped by its own watchdog stands after this time.
SLOWS = 0.1
#: attempts to have the device confirm the last, safe command
TRIES = 3

Readings = Mapping[str, Mapping[str, Any]]
Result = TypeVar("Result")


class Reading(NamedTuple):
    """Values read from a device, by port, and their wall time in s."""

    at: float
    values: dict[str, DefDict]


class Call(NamedTuple):
    """A call of the driver's code that may hang: its name and its start, wall s."""

    name: str
    at: float


class DeviceThread(Thread):
    """Thread that connects, exchanges at a rate, reconnects, and at the end stops.

    The thread shares no lock with other threads and prints nothing, since a full pipe
    would block it: its messages wait in `notes`.
    """

    def __init__(self, device: "Driven"):
        super().__init__(name=f"device of {device.key}", daemon=True)
        self.device = device
        self.periodic = Periodic(1.0 / device.rate)
        schema = device.command.schema
        run, period = runtime(device), self.periodic.period
        self.watchdog = Watchdog(run, device.max_age, schema, period)
        #: set once the device has answered for the first time, or cannot be served
        self.ready = Event()
        self.ending = Event()
        self.notes: deque[str] = deque(maxlen=20)
        #: the call of the driver's code that runs now; None between two calls
        self.call: Call | None = None
        self.reading: Reading | None = None
        #: the error that ended the thread: a driver's fault, or no device at the start
        self.failure: BaseException | None = None
        #: at the end, why the robot may not stand; "" if its device has confirmed it
        self.unsure = ""
        self.connected = False
        self.cycles = self.rejected = self.reconnects = 0
        self._outs = {
            port: schema()
            for port, schema in device.published().items()
            if port != "command"
        }
        #: port/path of fields without a reading; emptied when they are reported
        self._unsaid = [
            f"{port}/{path}"
            for port, out in self._outs.items()
            for path in out.schema.paths
        ]
        self._motion = Motion(schema)
        self._asked: deque[tuple[Callable[[], Any], Future[Any]]] = deque()
        self._answered = 0.0
        #: wall s at which the last exchange ended; inf while one is under way
        self._spoke = 0.0
        #: whether the device has confirmed that it stands, since its last other command
        self._stands = False
        self._lost_at: float | None = None
        #: why it is lost, as it was noted
        self._why = ""
        self._back_off = BACK_OFF[0]

    # -- called by the stepping thread -------------------------------------------

    def ask(self, work: Callable[[], Any]) -> Future[Any]:
        """Queue `work` to be done between two exchanges, and return its future."""
        future: Future[Any] = Future()
        self._asked.append((work, future))
        return future

    def hangs(self, seconds: float) -> str:
        """Describe the running call if it is older than `seconds`; else return ""."""
        call = self.call
        lasts = wall() - call.at if call else 0.0
        if call is None or lasts < seconds:
            return ""
        stood = where(self)
        return f"{call.name} hangs for {lasts:.1f} s" + (f" ({stood})" if stood else "")

    def standing(self) -> Standing:
        """Return what is known of the device's standing still."""
        now = wall()
        if not self.ready.is_set():
            return SENT
        silent = now - (self._lost_at or self._answered)
        if self._lost_at is not None or silent > self.device.max_age:
            left = self.device.stops_alone
            if left is not None:
                left = max(0.0, left + SLOWS + min(0.0, self._spoke - now))
            return Standing("lost", silent, left)
        held = runtime(self.device).held
        # Of a STOP in this moment, the device thread may not know yet.
        known = not held or self.watchdog.why == "stopped"
        return Standing("confirmed" if self._stands and known else "sent")

    # -- the thread's loop -------------------------------------------------------

    def run(self) -> None:
        """Serve the device until `ending` is set, or the driver's code fails."""
        try:
            while not self.ending.is_set():
                try:
                    self._serve()
                except OSError as error:
                    self._lose(error)
        except BaseException as error:
            # The stepping thread reports and raises it; here, first stop the robot.
            self.failure = error
        finally:
            self._end()

    def _serve(self) -> None:
        """Serve one connection until the end. Raises OSError when it breaks."""
        self._do("connect()", self.device.connect)
        self.connected = True
        begun = self._answered = wall()
        self.periodic.restart()
        while self.periodic.wait(self.ending):
            self._cycle()
            if wall() - begun > HELD:
                self._back_off = BACK_OFF[0]
                if self._unsaid:  # reported once: another robot may have these fields
                    unsaid, self._unsaid = ", ".join(self._unsaid), []
                    self.note(f"receives nothing from its device of {unsaid}")

    def _cycle(self) -> None:
        expired = self.watchdog.expired
        command = self.watchdog.choose()
        if self.watchdog.expired == 1 > expired:
            limit = f"it lives for {self.device.max_age:g} s"
            self.note(f"stops by itself: {self.watchdog.why}, and {limit}")
        safe = command == self.watchdog.safe
        self._stands &= safe
        begun = wall()
        self.cycles += 1
        self._motion.command(command, self.periodic.period)
        try:
            self._take(self._exchange(command))
            self._stands = safe and self.device.is_still()
        except (WireError, FieldValueError, TimeoutError) as error:
            self._reject(error)
        else:
            self._confirm()
        self._work()
        lasted = wall() - begun
        if lasted > self.device.max_age and not self.ending.is_set():
            # Its bytes may still be on their way: a new connection begins empty.
            raise OSError(f"an exchange took {lasted:.1f} s")

    def _exchange(self, command: DefDict) -> Readings | None:
        self._spoke = inf
        try:
            return self._do("exchange()", lambda: self.device.exchange(command))
        finally:
            self._spoke = wall()

    def _take(self, readings: Readings | None) -> None:
        """Keep the readings. Raises a RemsError that names what does not fit."""
        if readings is None:
            return
        if not isinstance(readings, Mapping):
            raise _no_readings(readings, self._outs)
        for port, values in readings.items():
            if port not in self._outs or not isinstance(values, Mapping):
                raise _no_readings(readings, self._outs, nearest(port, self._outs))
            self._outs[port].update(values)
            if self._unsaid:
                said = tuple(f"{port}/{key}/" for key in values)
                self._unsaid = [u for u in self._unsaid if not f"{u}/".startswith(said)]
        copies = {port: value.copy() for port, value in self._outs.items()}
        self.reading = Reading(wall(), copies)
        self._motion.read(copies.get("state"))

    def _confirm(self) -> None:
        """Note that the device has answered correctly."""
        self._answered = wall()
        if not self.watchdog.trusts:
            self.watchdog.trust()
            self.ready.set()
        if self._lost_at is not None:
            lasted = wall() - self._lost_at
            self._lost_at, self._why = None, ""
            self.reconnects += 1
            self.note(f"is back after {lasted:.1f} s: it obeys its commands now")

    def _reject(self, error: Exception) -> None:
        """Count a wrong or missing reply. Raises OSError after a long silence."""
        self.rejected += 1
        self._stands = False
        if self.rejected == 1:
            self.note(f"passes over a reply, and counts such: {error}")
        silent = wall() - self._answered
        if silent > self.device.max_age:
            # The device may obey a command of now only when it answers again.
            self.watchdog.distrust("the device does not answer")
        if silent > self.device.silence:
            raise OSError(f"no reply that fits for {silent:.1f} s; the last: {error}")

    def _work(self) -> None:
        """Do the first piece of work in the queue, if there is one."""
        if not self._asked:
            return
        work, future = self._asked.popleft()
        if not future.set_running_or_notify_cancel():
            return
        try:
            future.set_result(self._do("what it was asked for", work))
        except Exception as error:
            future.set_exception(error)
            if isinstance(error, OSError) and not isinstance(error, TimeoutError):
                raise

    def _lose(self, error: OSError) -> None:
        """Give the line back, and wait before the next attempt to connect."""
        first = not self.ready.is_set()
        if self._lost_at is None and not first:
            self._lost_at = self._answered
        if self._lost_at is not None:
            self._explain(error)
        self._disconnect()
        if first:
            raise error
        self.ending.wait(self._back_off)
        self._back_off = min(2 * self._back_off, BACK_OFF[1])

    def _explain(self, error: OSError) -> None:
        """Note why the device is lost: at first, and when the reason changes."""
        why = str(self.device.explain(error) or error)
        if why != self._why:
            lost = f"has lost its device ({why}); it tries to reach it again"
            self.note(f"is still without its device: {why}" if self._why else lost)
            self._why = why

    def _disconnect(self) -> None:
        self.connected = False
        self.watchdog.distrust("not connected")
        while self._asked:
            _, future = self._asked.popleft()
            if future.set_running_or_notify_cancel():
                future.set_exception(OSError("the device is not connected"))
        with suppress(OSError):  # it is broken already
            self._do("disconnect()", self.device.disconnect)

    def _end(self) -> None:
        """Send the safe command until it is confirmed, and give the line back."""
        self.watchdog.distrust("closed")
        if self.connected:
            self._stand()
        elif self._lost_at is not None:
            self.unsure = str(self.standing())
        if never := self._motion.never():
            self.note(never)
        try:
            self._disconnect()
        except Exception as error:
            self.failure = self.failure or error
        self.ready.set()

    def _stand(self) -> None:
        """Send the safe command until the device confirms it, TRIES times at most."""
        for _ in range(TRIES):
            try:
                self._exchange(self.watchdog.safe)
            except Exception as error:
                # Any error: the next attempt matters more.
                why = describe(error)
            else:
                return
            Event().wait(self.periodic.period)
        self.note(f"did not confirm its last, safe command: {why}")

    def _do(self, name: str, call: Callable[[], Result]) -> Result:
        self.call = Call(name, wall())
        try:
            return call()
        finally:
            self.call = None

    def note(self, sentence: str) -> None:
        self.notes.append(f"{self.device.key} {sentence}")


def _no_readings(
    came: object, ports: Mapping[str, object], hint: str = ""
) -> Exception:
    return SchemaError(
        f"exchange() returned {came!r}; expected None, or fields by port, such as "
        f'{{"state": {{"x": 0.1}}}}; the ports are {", ".join(ports)}.{hint} (R0304)'
    )
