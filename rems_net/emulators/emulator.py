"""Emulator: a device behind a line, in a thread of its own, and what goes wrong there.

with Emulator(Create2Device(), Terminal(Path("create2"))) as emulator:
    emulator.tell("corrupt 0.05")
    emulator.tell("unplug 5")
"""

import time
from collections import deque
from collections.abc import Callable, Mapping
from queue import SimpleQueue
from threading import Event, Thread
from typing import Generic, Protocol, Self, TypeVar

from rems_net.emulators import words
from rems_net.emulators.faults import BITS, Faults, resampled

#: seconds that a packet waits for those before it, at most
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
    """What answers at a line. All of it is called in the emulator's thread.

    baud: bits per second that it speaks at.  period: seconds between two calls of
    `live`.  words: what can happen to it besides: `{"lift": {"": f}, "bump": {"left":
    g}}` for `lift`, and `bump left`.
    """

    period: float

    @property
    def baud(self) -> int: ...
    @property
    def words(self) -> Mapping[str, Mapping[str, Callable[[], None]]]: ...
    def hear(self, portion: bytes) -> list[bytes]:
        """Take in what came, and return the packets that it answers at once."""

    def live(self, dt: float) -> list[bytes]:
        """Let `dt` seconds pass, and return the packets that it says by itself."""

    def power(self, on: bool) -> list[bytes]:
        """Lose its battery, or get it back: then it starts anew."""

    def status(self) -> str:
        """How it is, in a few words; asked from any thread."""


AnyDevice = TypeVar("AnyDevice", bound=Device)


class Emulator(Generic[AnyDevice]):
    """Serves `device` at `line`, from `with` until its end.

    said, heard: faults of the packets from and to the device.  echo: whether what it
    hears comes back first, as on a bus of one wire.
    """

    def __init__(self, device: AnyDevice, line: Line):
        self.device, self.line = device, line
        self.said, self.heard = Faults(seed=1), Faults(seed=2)
        self.echo = False
        #: what ended its thread
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
        """What a driver takes for its port: a path, or an address."""
        return self.line.where

    def status(self) -> str:
        """How it is, in a few words: what it obeys, and where it is."""
        return self.device.status()

    @property
    def words(self) -> list[str]:
        """What it can be told, such as `unplug SECONDS`."""
        return words.known(self)

    def tell(self, sentence: str) -> None:
        """Let something happen, such as `unplug 5`. Raises ExperimentError."""
        self._asked.put(words.read(self, sentence))

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
        """Nothing goes wrong any more; what is late still is lost."""
        self._due.clear()
        self._busy = 0.0
        self.said.clear()
        self.heard.clear()
        self.echo = False

    def _in(self, seconds: float, work: Callable[[], None]) -> None:
        self._later.append((time.monotonic() + seconds, work))

    # -- its life ----------------------------------------------------------------

    def _run(self) -> None:
        try:
            self._live()
        except BaseException as error:
            self.failure = error  # raised where it was started
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
        """What was asked for, and what had been put off until now."""
        while not self._asked.empty():
            self._asked.get()()
        for moment in [one for one in self._later if one[0] <= now]:
            self._later.remove(moment)
            moment[1]()

    def _say(self, packets: list[bytes]) -> None:
        """Put packets on their way: one after the other, as fast as a line is.

        What a line is too slow for is not said.
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
        """The bytes as they arrive: others, where the two ends differ in speed."""
        here, there = self.device.baud, self.line.baud
        if there is None or there == here:
            return portion
        ends = (there, here) if to_device else (here, there)
        return resampled(portion, *ends)
