"""Driven: base of the drivers of hardware, and of everything paced by wall time."""

import sys
from collections.abc import Callable, Mapping
from math import inf
from threading import current_thread
from typing import Any, ClassVar, TypeVar

from rems_net.agents.about.standing import SENT, Standing, alone
from rems_net.agents.diagnosis import describe
from rems_net.agents.ports import Settings
from rems_net.agents.robot import Driver, driver_of
from rems_net.agents.runtime import runtime
from rems_net.agents.verbs import verb
from rems_net.agents.wall import wall
from rems_net.defdict import DefDict, frequency
from rems_net.drivers.hardware.device_thread import DeviceThread, Readings
from rems_net.errors import AgentError, SchemaError, uncoded
from rems_net.events import warn

#: s. A device must answer for the first time within this.
OPEN = 10.0
#: s. A computing thread yields to the device thread after this. With Python's own 5 ms,
#: each read and write would wait that long: together, longer than an exchange.
SWITCH = 0.0001
#: s. close() may take this long to stop a robot.
CLOSE = 1.0

Result = TypeVar("Result")


class NoDeviceError(OSError):
    """No device was found; the message lists what the user has to check, in order."""


class Driven(Driver):
    """Base of hardware drivers: a thread of its own serves the device at its rate.

    Write `connect`, `exchange` and `disconnect`; all three run in the device thread,
    and nowhere else. The robot obeys the newest command while that is fresh, and its
    safe command whenever it is not: `docs/hardware.md`.

    rate: exchanges per second; the option of that name may be lower.
    silence: s. Without a correct reply for this long, the line counts as broken, and
        the driver connects again
    checks: what the user has to check if there is no device; a NoDeviceError has its
        own list
    """

    lockstep = False
    options = Settings(
        rate=frequency("Hz", range=(0, 10_000), doc="exchanges; 0: the driver's own")
    )
    rate: float = 50.0
    silence: ClassVar[float] = 1.0
    checks: ClassVar[str] = (
        "Check, in this order: 1. that it is switched on; 2. that it is plugged in; 3. "
        "its name or address."
    )

    _device: DeviceThread | None = None
    _told_hang = False
    _warned = False

    # -- written by a driver's author --------------------------------------------

    def connect(self) -> None:
        """Acquire the line, and bring the device into a mode that obeys commands.

        Runs again after every loss. Raises OSError if there is no device: at the
        start that ends the agent; later the thread tries again.
        """

    def exchange(self, command: DefDict) -> Readings | None:
        """Write `command` to the device, then return its readings.

        Returns fields by port, `{"state": {"x": 0.1}, "sensors": {...}}`: all, some
        (the others stay as they are), or None. It must return within `silence`.

        Raises WireError for a reply that does not fit, TimeoutError for one that does
        not come: both are counted, and the loop goes on. OSError: the line is broken.
        Anything else is a mistake in the driver, and ends the agent.
        """
        raise NotImplementedError(
            f"{type(self).__name__} must define exchange(self, command)."
        )

    def disconnect(self) -> None:
        """Give back what `connect` acquired: all of it, some, or nothing yet."""

    def is_still(self) -> bool:
        """Return whether the device's newest reply reports that it stands.

        Called after each exchange that has sent the safe command. Without this method,
        no STOP of this robot is ever reported as confirmed.
        """
        return False

    @property
    def stops_alone(self) -> float | None:
        """Seconds without a message after which the device stops by itself.

        None: it has no watchdog, and drives on.
        """
        return None

    def explain(self, error: OSError) -> str:
        """Return what an OSError means for a user beside the robot; or ""."""
        return ""

    # -- for use by a driver -----------------------------------------------------

    def perform(self, work: Callable[[], Result], seconds: float = 1.0) -> Result:
        """Do `work` in the device thread, between two exchanges, and return its result.

        For verbs that talk to the device: a line has one user. Raises what `work`
        raises, and TimeoutError when it is not done within `seconds`.
        """
        device = self._device
        if device is None or not device.is_alive() or device is current_thread():
            return work()  # there is no other user
        asked = device.ask(work)
        try:
            result: Result = asked.result(seconds)
        finally:
            asked.cancel()  # nobody waits for it any more: do not do it later
        return result

    def note(self, sentence: str) -> None:
        """Report an event of the robot: a sentence that follows its key."""
        if self._device is not None:
            self._device.note(sentence)

    @property
    def standing(self) -> Standing:
        device = self._device
        return SENT if device is None else device.standing()

    @property
    def reading_age(self) -> float:
        """Seconds of wall time since `state` was read; inf before the first reading."""
        reading = self._device and self._device.reading
        return wall() - reading.at if reading else inf

    @verb
    def figures(self) -> dict[str, Any]:
        """Return statistics of the exchanges.

        safe: why the safe command is obeyed instead of the robot's; "" if it is not.
        age: of the newest reading, in s. cycles: exchanges. missed: deadlines passed
        over. worst: longest delay of an exchange, in s. rejected: wrong or missing
        replies. reconnects. expired: how often a command became too old.
        """
        device = self._device
        if device is None:
            raise AgentError(self.key, "it is not open yet: call open() first. (R0313)")
        return {
            "connected": device.connected,
            "safe": device.watchdog.why,
            "age": self.reading_age,
            "cycles": device.cycles,
            "missed": device.periodic.missed,
            "worst": device.periodic.worst,
            "rejected": device.rejected,
            "reconnects": device.reconnects,
            "expired": device.watchdog.expired,
        }

    #: the newest reading that was copied, and the tick of that
    _copied: Any = None
    _copied_at = 0

    # -- called by the host, in its stepping thread ------------------------------

    def prepare(self) -> None:
        super().prepare()
        if asked := self.options.get("rate"):
            most = type(self).rate
            if asked > most:
                raise SchemaError(
                    f"{self.key} has rate = {asked:g} Hz; expected {most:g} Hz at "
                    f"most, which is {driver_of(type(self)).__name__}'s own. (R0309)"
                )
            self.rate = asked
        least = 2 / self.max_age
        if not least <= self.rate <= 10_000:
            raise SchemaError(
                f"{type(self).__name__}.rate is {self.rate!r}; expected exchanges per "
                f"second, at least {least:g}, since a command lives {self.max_age:g} "
                "s. (R0309)"
            )

    def open(self) -> None:
        """Start the device thread, and wait for the device's first answer.

        Raises AgentError with the cause if there is no answer.
        """
        sys.setswitchinterval(min(SWITCH, sys.getswitchinterval()))
        self._device = device = DeviceThread(self)
        device.start()
        if not device.ready.wait(OPEN):
            hangs = device.hangs(0.0) or "it is silent"
            raise AgentError(self.key, f"no answer of the device: {hangs}. (R0310)")
        if isinstance(device.failure, OSError):
            failure, device.failure = device.failure, None
            why = f"{self.explain(failure) or describe(failure)}. {self.checks}"
            if isinstance(failure, NoDeviceError):
                why = str(failure)
            raise AgentError(
                self.key,
                f"there is no connection to its device: {uncoded(why)} (R0310)",
            )
        self._look()

    def rewind(self) -> None:
        """Reset the state; later readings of the device count from there."""
        super().rewind()
        if self._device is not None:
            self._device.reading = None

    def drive(self, command: DefDict, dt: float) -> None:
        """Hand the command to the device thread, which obeys it from now on."""
        device = self._device
        if device is None:
            return
        run = runtime(self)
        device.watchdog.tell(command, run.source_ticks.get("command"))
        apart = dt / (run.tick.pace or 1.0)
        if apart > self.max_age and not self._warned:
            self._warned = True
            self._warn(
                f"{self.key} stops between two ticks: they come every {apart:g} s, and "
                f"a command lives {self.max_age:g} s"
            )

    def sense(self) -> None:
        """Copy the newest reading to the ports; before it, the state is `initial`.

        The values are as old as the reading.
        """
        self._look()
        reading = self._device and self._device.reading
        for port, value in reading.values.items() if reading else ():
            setattr(self, port, value)
        run = runtime(self)
        if reading is not self._copied:
            self._copied, self._copied_at = reading, run.tick.n
        run.source_tick = self._copied_at

    def close(self) -> None:
        """Stop the robot and end the device thread, within about CLOSE.

        Raises AgentError if the robot may not have stopped.
        """
        device = self._device
        if device is None:
            return
        self._device = None
        device.ending.set()
        device.join(CLOSE)
        unsure = device.unsure and f"it {device.unsure}"
        if device.is_alive():
            hangs = device.hangs(0.0) or "its device does not answer"
            unsure = f"{hangs}: {alone(self.stops_alone)}"
        elif unsure and self.stops_alone is not None:
            device.note(device.unsure)
            unsure = ""
        self._report(device)
        if device.cycles:
            print(f"{self.key}: {_summary(device)}", flush=True)
        if unsure:
            raise AgentError(self.key, f"{unsure}. (R0311)")
        if device.failure is not None:
            raise device.failure

    def _look(self) -> None:
        """Report the device thread's notes, and raise the error that ended it."""
        device = self._device
        if device is None:
            return
        self._report(device)
        hangs = device.hangs(self.max_age)
        if hangs and not self._told_hang:
            self._warn(f"{self.key} receives nothing: {hangs}")
        self._told_hang = bool(hangs)
        if device.failure is not None:
            failure, device.failure = device.failure, None
            raise failure

    def _report(self, device: DeviceThread) -> None:
        while device.notes:
            self._warn(device.notes.popleft())

    def _warn(self, sentence: str) -> None:
        warn("device", sentence, self.key)


def _summary(device: DeviceThread) -> str:
    """Return the statistics as one line, for the end of a run."""
    worst = device.periodic.worst * 1e3
    late = f"{device.periodic.missed} missed, worst {worst:.1f} ms late"
    words: Mapping[str, int] = {
        "rejected": device.rejected,
        "reconnected": device.reconnects,
        "expired": device.watchdog.expired,
    }
    more = "".join(f", {count} {what}" for what, count in words.items() if count)
    return f"{device.cycles} exchanges at {device.device.rate:g} Hz, {late}{more}"
