"""OpenInterface: a Create 2 at a serial port, driven wheel by wheel."""

from collections import deque
from collections.abc import Mapping
from itertools import cycle
from threading import Event
from typing import Any

from rems_net.agents.ports import Out, Settings
from rems_net.agents.verbs import verb
from rems_net.agents.wall import wall
from rems_net.defdict import DefDict, choice
from rems_net.drivers.hardware.create2 import commands, readings
from rems_net.drivers.hardware.create2.commands import FLUSH, TEMPO, TOP_SPEED, Op
from rems_net.drivers.hardware.create2.packets import COUNTS, MODES, WRAP
from rems_net.drivers.hardware.create2.readings import allows, reason
from rems_net.drivers.hardware.create2.stream import Stream
from rems_net.drivers.hardware.create2.waking import (
    SETTLE,
    begin,
    call_back,
    hear_first,
    is_awake,
)
from rems_net.drivers.hardware.device_thread import Readings
from rems_net.drivers.hardware.odometry import Rolling
from rems_net.drivers.hardware.serial import SerialDriven
from rems_net.errors import FieldValueError, SchemaError, WireError

#: s. A robot reports the speeds of a command within this time after we wrote it.
HEARS = 0.15
#: m. Sizes in the Open Interface's specification; and a measured size's largest error.
SIZES, DIFFERS = {"wheel_radius": 0.036, "track": 0.235}, 0.1

Speeds = tuple[int, int]


class OpenInterface(Rolling, SerialDriven):
    """Driver of an iRobot Create 2, or a Roomba 500 or 600, over its serial cable.

    In `safe` mode the robot stops by itself at a cliff, when it is lifted, and when its
    charger is plugged in; in `full` mode it does not. It has no
    watchdog: when its cable is pulled out, it keeps the speeds of its last command.

    status: values that only the device has: battery, mode, buttons, motors' currents.
    """

    needs = ("serial",)
    options = Settings(
        SerialDriven.options.fields,
        mode=choice("safe", "full", doc="whether it stops itself at a cliff"),
    )
    status = Out(readings.STATUS)
    rate = 50.0
    counts, wrap, fits = COUNTS, WRAP, "create2"
    timeout = 0.1
    halt = FLUSH + commands.drive_direct(0, 0)
    farewell = bytes([Op.PAUSE, 0, Op.START])

    #: the robot's newest sensor frame; None before the first one
    _seen: Mapping[str, int] | None = None
    #: number of values that cannot be
    _impossible = 0

    def __init__(self, name: str = "", **rest: Any):
        super().__init__(name, **rest)
        #: baud rates at which the robot may be listening instead of ours
        self._deaf = cycle(commands.BAUDS[:2])

    def prepare(self) -> None:
        """Check that the definition has two wheels, a pose, and right sizes."""
        super().prepare()
        for name, size in SIZES.items():
            # With another robot's sizes, speeds and odometry would be wrong.
            if not abs((has := self.parameters[name]) - size) <= DIFFERS * size:
                raise SchemaError(
                    f"{self.key} has a {name} of {has:g} m, and a Create 2 one of "
                    f"{size:g} m: a measured one differs by 10 % at most. Take the "
                    'definition "create2", or one that inherits from it. (R0306)'
                )

    # -- run in the device thread ------------------------------------------------

    def connect(self) -> None:
        """Open the port, wake the robot, and start its sensor stream, every 15 ms."""
        super().connect()
        self._stream = Stream(readings.numbers())
        self._told: deque[tuple[float, Speeds]] = deque()
        self._doubt, self._fallen = True, ""
        line = self.line
        assert line is not None
        awake = is_awake(line)
        if not awake and self._seen:
            call_back(line, next(self._deaf))
            awake = is_awake(line)
        if not awake:  # after a loss of power, its encoders count from zero
            self._path.forget()
        self._stream.too_high = begin(line, self.options.mode)
        if self._stream.too_high and not self._seen:
            self.note("reports its mode plus one, as some Roombas do: 1 is subtracted")
        self._say(commands.drive_direct(0, 0))
        self._say(commands.stream(self._stream.numbers))
        hear_first(line, self._stream, self.options.port, closely=not self._seen)

    def exchange(self, command: DefDict) -> Readings | None:
        """Send the wheels' speeds, and return the readings of the newest frame."""
        speeds = self._speeds(command)
        if self._fallen:  # send zero speeds until its mode can safely be set again
            if self._seen and allows(self._seen, speeds):
                self._say(FLUSH + bytes([Op[self.options.mode.upper()]]))
            speeds = 0, 0
        self._say(commands.drive_direct(*speeds), speeds)
        damaged = self._stream.damaged
        values = self._newest(speeds)
        self._path.feed(values["encoder_left"], values["encoder_right"])
        self._look_after(values)
        if self._stream.damaged > damaged:
            raise WireError("a frame of its sensors does not add up")
        return self._readings(values)

    def is_still(self) -> bool:
        return self._seen is not None and _stands(self._seen)

    def disconnect(self) -> None:
        """Stop the robot, and leave it in a mode in which it can sleep and charge."""
        if self.line is not None:
            try:
                self._say(self.halt)
                self._say(self.farewell)
                Event().wait(SETTLE)  # closing the port discards unsent bytes
            except OSError:
                pass  # the line is broken already
        super().disconnect()

    def _speeds(self, command: DefDict) -> Speeds:
        """Return the speeds of the right and the left wheel, in mm/s."""
        scale = 1000 * self.parameters.wheel_radius
        both = (round(command[f"wheel/{side}"] * scale) for side in ("right", "left"))
        right, left = (max(-TOP_SPEED, min(TOP_SPEED, speed)) for speed in both)
        return right, left

    def _say(self, what: bytes, speeds: Speeds | None = None) -> None:
        """Write a command; if the last one may be damaged, write FLUSH before it."""
        if self.line is None:
            raise OSError("the port is not open")
        if speeds is not None:
            self._told.append((wall(), speeds))
            if self._doubt:
                what, self._doubt = FLUSH + what, False
        self.line.write(what)

    def _newest(self, speeds: Speeds) -> Mapping[str, int]:
        """Return the newest frame; after a stop command, one that shows zero speeds.

        Raises TimeoutError if none comes, WireError if a frame shows another command.
        """
        until = wall() + self.timeout
        assert self.line is not None
        frames, wanted = self._stream.feed(self.line.read(self.line.in_waiting)), 1
        if speeds == (0, 0) and len(self._told) > 1 and self._told[-2][1] != speeds:
            # Frames in the buffer are older than the stop command. The robot may also
            # have begun the next frame before the command arrived: wait for two.
            frames, wanted = [], 2
        while len(frames) < wanted or (speeds == (0, 0) and not _stands(frames[-1])):
            if wall() > until:
                self._doubt = True
                raise TimeoutError(
                    "it does not report that it stands"
                    if frames
                    else f"no frame of its sensors for {self.timeout * 1e3:g} ms"
                )
            size = max(self.line.in_waiting, self._stream.missing)
            frames += self._stream.feed(self.line.read(size))
        # Keep the last two commands even if old: reading a frame may be delayed.
        while len(self._told) > 2 and self._told[0][0] < wall() - HEARS:
            self._told.popleft()
        known = [told for _, told in self._told]
        for one in frames:
            if not _stands(one) and _asked(one) not in known:
                self._doubt = True
                raise WireError(
                    f"it obeys {_asked(one)} mm/s (right, left), and its command is "
                    f"{known[-1]}: a command was damaged on its way"
                )
        return frames[-1]

    def _look_after(self, values: Mapping[str, int]) -> None:
        """Note when the robot has stopped by itself, and when it obeys again."""
        left_mode = values["mode"] != MODES.index(self.options.mode)
        self._seen = values
        if left_mode and not self._fallen:
            self._fallen = reason(values)
            self.note(f"stands by itself: {self._fallen}")
        elif self._fallen and not left_mode:
            self._fallen = ""
            self.note("obeys its commands again")

    def _readings(self, values: Mapping[str, int]) -> Readings:
        try:
            status = readings.status(values)
        except IndexError:
            raise WireError(
                f"it reports mode {values['mode']}, and charging in state "
                f"{values['charging']}: there are none such"
            ) from None
        self._impossible += sum(path not in status for path in readings.BATTERY)
        status["battery/impossible"] = self._impossible
        return {**self.rolled(readings.sensors(values, self._path)), "status": status}

    @verb
    def beep(self, note: int = 72, seconds: float = 0.25) -> None:
        """Play a note: its number in MIDI, 31 to 127, for at most 4 s."""
        lasts = round(seconds * TEMPO)
        if not (31 <= note <= 127 and 1 <= lasts <= 255):
            raise FieldValueError(
                f"beep({note!r}, {seconds!r}): expected a note of MIDI, 31 to 127 (72 "
                "is a C), and 0.02 to 3.98 s. (R0314)"
            )
        slot = commands.SONGS - 1
        song = commands.song(slot, [(note, lasts)]) + bytes([Op.PLAY, slot])
        self.perform(lambda: self._say(song))

    @verb
    def display(self, text: str) -> None:
        """Show up to four characters on the robot's display, if it has one."""
        shown = text[:4].ljust(4)
        if not (shown.isascii() and shown.isprintable()):
            raise FieldValueError(
                f"display({text!r}): expected plain ASCII letters. (R0314)"
            )
        self.perform(lambda: self._say(bytes([Op.DIGITS]) + shown.encode()))


def _asked(values: Mapping[str, int]) -> Speeds:
    """Return the speeds that the robot reports as commanded: right, left, mm/s."""
    return values["requested_right"], values["requested_left"]


def _stands(values: Mapping[str, int]) -> bool:
    """Return whether the frame reports that the wheels stand; they do in Passive."""
    return values["mode"] < MODES.index("safe") or _asked(values) == (0, 0)
