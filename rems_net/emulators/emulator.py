"""Emulator: a device behind a line, in its own thread, and the faults of both.

with Emulator(Create2Device(), Terminal(Path("create2"))) as emulator:
    emulator.order("corrupt 0.05")
    emulator.order("unplug 5")
"""

import time
from collections import deque
from collections.abc import Callable, Mapping
from queue import SimpleQueue
from threading import Event, Thread
from typing import Generic, Protocol, Self, TypeVar

from rems_net.emulators import commands
from rems_net.emulators.faults import BITS, Faults, resampled

#: s. A packet that would wait longer for those before it is dropped.
BACKLOG = 0.5


class Line(Protocol):
    """One end of a line that can be pulled out."""

    @property
    def where(self) -> str: ...
    @property
    def baud(self) -> int | None: ...
    def plug(self) -> None: ...
    def unplug(self) -> None: ...
    def receive(self, seconds: float) -> bytes: ...
    def send(self, portion: bytes) -> None: ...
    def close(self) -> None: ...


class Device(Protocol):
    """A device at a line. The emulator's thread calls all of it.

    baud: bits per second of the device.  period: s between two calls of `live`.
    words: what can happen to it besides: `{"lift": {"": f}, "bump": {"left": g}}` for
    `lift`, and `bump left`.
    """

    period: float

    @property
    def baud(self) -> int: ...
    @property
    def words(self) -> Mapping[str, Mapping[str, Callable[[], None]]]: ...
    def hear(self, portion: bytes) -> list[bytes]:
        """Take in bytes from the line, and return the packets of the answer."""

    def live(self, dt: float) -> list[bytes]:
        """Let `dt` seconds pass, and return the packets that it sends unasked."""

    def power(self, on: bool) -> list[bytes]:
        """Lose its battery (False), or get it back (True) and start anew."""

    def status(self) -> str:
        """Return its state in a few words; called from any thread."""


AnyDevice = TypeVar("AnyDevice", bound=Device)


class Emulator(Generic[AnyDevice]):
    """Operation of `device` at `line`, from `with` until its end.

    said, heard: faults of the packets from and to the device.  echo: whether each
    packet to the device comes back first, as on a bus of one wire.
    """

    def __init__(self, device: AnyDevice, line: Line):
        self.device, self.line = device, line
        self.said, self.heard = Faults(seed=1), Faults(seed=2)
        self.echo = False
        #: The error that ended its thread; None if there was none.
        self.failure: BaseException | None = None
        self._asked: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._later: list[tuple[float, Callable[[], None]]] = []
        self._due: deque[tuple[float, bytes]] = deque()
        self._busy = 0.0
        self._on = True
        self._ending = Event()
        self._thread = Thread(target=self._run, name="emulator", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ending.set()
        self._thread.join()
        self.line.close()
        if self.failure is not None:
            raise self.failure

    # -- from any thread ---------------------------------------------------------

    @property
    def where(self) -> str:
        """The port for a driver: a path, or an address."""
        return self.line.where

    def status(self) -> str:
        """Return its state in a few words: what it obeys, and where it is."""
        return self.device.status()

    @property
    def words(self) -> list[str]:
        """The sentences that `order` takes, such as `unplug SECONDS`."""
        return commands.known(self)

    def order(self, sentence: str) -> None:
        """Let something happen, such as `unplug 5`. Raises ExperimentError."""
        self._asked.put(commands.read(self, sentence))

    # -- what can happen, in its own thread --------------------------------------

    def unplug(self, seconds: float) -> None:
        """Pull the line out; the device itself goes on."""
        self._due.clear()
        self.line.unplug()
        self._in(seconds, self.line.plug)

    def brown_out(self, seconds: float) -> None:
        """Take the device's power away for so long; the line stays plugged in."""
        self._on = False
        self._due.clear()
        self.device.power(False)

        def power_up() -> None:
            self._on = True
            self._say(self.device.power(True))

        self._in(seconds, power_up)

    def clear(self) -> None:
        """End all faults; packets that are still late are lost."""
        self._due.clear()
        self._busy = 0.0
        self.said.clear()
        self.heard.clear()
        self.echo = False

    def _in(self, seconds: float, work: Callable[[], None]) -> None:
        self._later.append((time.monotonic() + seconds, work))

    def _run(self) -> None:
        try:
            self._live()
        except BaseException as error:
            self.failure = error  # raised at the end of `with`
            self.line.unplug()

    def _live(self) -> None:
        lived = time.monotonic()
        due = lived + self.device.period
        while not self._ending.is_set():
            now = time.monotonic()
            self._happen(now)
            if now >= due:
                said = self.device.live(now - lived)
                lived = now
                due = max(due + self.device.period, now)
                if self._on:
                    self._say(said)
            while self._due and self._due[0][0] <= now:
                packet = self._due.popleft()[1]
                self.line.send(self._arrived(packet, to_device=False))
            waits = (*self._later, *list(self._due)[:1])
            next_one = min([due, *(at for at, _ in waits)])
            came = self.line.receive(max(0.0, next_one - time.monotonic()))
            if came and self._on:
                if self.echo:
                    self._say([came])
                came = self.heard.damage(came)
                self._say(self.device.hear(self._arrived(came, to_device=True)))

    def _happen(self, now: float) -> None:
        """Do what was asked for, and what was put off until now."""
        while not self._asked.empty():
            self._asked.get()()
        for moment in [one for one in self._later if one[0] <= now]:
            self._later.remove(moment)
            moment[1]()

    def _say(self, packets: list[bytes]) -> None:
        """Queue packets, one after the other, at the speed of the line.

        Packets for which the line is too slow are dropped.
        """
        for packet in packets:
            ready = time.monotonic() + self.said.late
            begun = max(self._busy, ready)
            if begun - ready > BACKLOG:
                continue
            came = self.said.damage(packet)
            self._busy = begun + len(packet) * BITS / self.device.baud
            if came:
                self._due.append((self._busy, came))

    def _arrived(self, portion: bytes, to_device: bool) -> bytes:
        """Return the bytes as they arrive: garbled if the two ends differ in speed."""
        here, there = self.device.baud, self.line.baud
        if there is None or there == here:
            return portion
        ends = (there, here) if to_device else (here, there)
        return resampled(portion, *ends)
