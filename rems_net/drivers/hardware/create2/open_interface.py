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
    call_back,
    hear_first,
    is_awake,
)
from rems_net.drivers.hardware.device_thread import Readings
from rems_net.drivers.hardware.odometry import Odometer
from rems_net.drivers.hardware.serial import SerialDriven
from rems_net.errors import FieldValueError, SchemaError, WireError

#: seconds in which a robot says that it heard what it was told
HEARS = 0.15
#: what a definition has to have
NEEDED = {
    "parameters": ("wheel_radius", "track"),
    "command": ("wheel/left", "wheel/right"),
    "state": ("x", "y", "heading"),
}
#: what it is like, m: the Open Interface's; and how far a measured one may differ
SIZES, DIFFERS = {"wheel_radius": 0.036, "track": 0.235}, 0.1

TAKE = 'Take the definition "create2", or one that inherits from it.'

Speeds = tuple[int, int]


class OpenInterface(SerialDriven):
    """Drives an iRobot Create 2, or a Roomba 500 or 600, over its serial cable.

    In `safe` mode the robot stops by itself at a cliff, when it is lifted, and when
    its charger is plugged in; in `full` mode it does nothing of the kind. It has no
    watchdog: when its cable is pulled out, it goes on with what it was told last.

    status: what only the device has: battery, mode, buttons, motors' currents.
    """

    needs = ("serial",)
    options = Settings(
        SerialDriven.options.fields,
        mode=choice("safe", "full", doc="whether it stops itself at a cliff"),
    )
    status = Out(readings.STATUS)
    rate = 50.0
    timeout = 0.1
    halt = FLUSH + commands.drive_direct(0, 0)
    farewell = bytes([Op.PAUSE, 0, Op.START])

    #: its newest frame
    _seen: Mapping[str, int] | None = None

    def __init__(self, name: str = "", **rest: Any):
        super().__init__(name, **rest)
        #: speeds at which it may be deaf to ours
        self._deaf = cycle(commands.BAUDS[:2])

    def prepare(self) -> None:
        """Check that it is told how fast two wheels turn, and tells where it is."""
        for port, paths in NEEDED.items():
            slot = getattr(type(self), port)
            schema = slot.schema_for(self.parameters) if port != "parameters" else None
            fields = schema or self.parameters.schema
            if lacks := [path for path in paths if path not in fields.paths]:
                raise SchemaError(
                    f"{self.key} can't be: a Create 2 needs {port} with "
                    f"{', '.join(paths)}, and it has no {lacks[0]!r}. {TAKE}"
                )
        for name, size in SIZES.items():
            # Of another robot: it would drive too fast, or think that it is elsewhere.
            if not abs((has := self.parameters[name]) - size) <= DIFFERS * size:
                raise SchemaError(
                    f"{self.key} has a {name} of {has:g} m, and a Create 2 one of "
                    f"{size:g} m: a measured one differs by 10 % at most. {TAKE}"
                )
        super().prepare()

    # -- the device thread's -----------------------------------------------------

    def connect(self) -> None:
        """Open the port, wake the robot, and have it say its sensors every 15 ms."""
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
        if not awake:  # it may have lost its power, and count from zero
            self._path.forget()
        for command in (Op.START, Op[self.options.mode.upper()]):
            self._say(bytes([command]))
            Event().wait(SETTLE)
        self._say(commands.drive_direct(0, 0))
        self._say(commands.stream(self._stream.numbers))
        hear_first(line, self._stream, self.options.port, closely=not self._seen)

    def exchange(self, command: DefDict) -> Readings | None:
        """Tell it its wheels' speeds, and read its newest frame."""
        speeds = self._speeds(command)
        if self._fallen:  # back to its mode once that is safe; standing until then
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

    def disconnect(self) -> None:
        """Have it stand, and leave it so that it can sleep and be charged."""
        if self.line is not None:
            try:
                self._say(self.halt)
                self._say(self.farewell)
                Event().wait(SETTLE)  # what is thrown away below has left by then
            except OSError:
                pass  # the line is broken already
        super().disconnect()

    def _speeds(self, command: DefDict) -> Speeds:
        """The right wheel's speed, and the left one's, in mm/s."""
        scale = 1000 * self.parameters.wheel_radius
        both = (round(command[f"wheel/{side}"] * scale) for side in ("right", "left"))
        right, left = (max(-TOP_SPEED, min(TOP_SPEED, speed)) for speed in both)
        return right, left

    def _say(self, what: bytes, speeds: Speeds | None = None) -> None:
        """Write a command; after a doubt, behind what ends a broken one."""
        if self.line is None:
            raise OSError("the port is not open")
        if speeds is not None:
            self._told.append((wall(), speeds))
            if self._doubt:
                what, self._doubt = FLUSH + what, False
        self.line.write(what)

    def _newest(self, speeds: Speeds) -> Mapping[str, int]:
        """The newest frame; of one that is to stand, the first that says it does.

        Raises TimeoutError if none comes, WireError if it obeys something else.
        """
        until = wall() + self.timeout
        assert self.line is not None
        frames, wanted = self._stream.feed(self.line.read(self.line.in_waiting)), 1
        if speeds == (0, 0) and len(self._told) > 1 and self._told[-2][1] != speeds:
            # What was said before it could hear of it says nothing about standing; so
            # may the next frame, which had begun.
            frames, wanted = [], 2
        while len(frames) < wanted or (speeds == (0, 0) and not _stands(frames[-1])):
            if wall() > until:
                self._doubt = True
                raise TimeoutError(
                    "it does not say that it stands"
                    if frames
                    else f"no frame of its sensors for {self.timeout * 1e3:g} ms"
                )
            size = max(self.line.in_waiting, self._stream.missing)
            frames += self._stream.feed(self.line.read(size))
        # The last two always count: a frame may have waited while we were held up.
        while len(self._told) > 2 and self._told[0][0] < wall() - HEARS:
            self._told.popleft()
        known = [told for _, told in self._told]
        for one in frames:
            if not _stands(one) and _asked(one) not in known:
                self._doubt = True
                raise WireError(
                    f"it obeys {_asked(one)} mm/s (right, left), and was told "
                    f"{known[-1]}: a command was damaged on its way"
                )
        return frames[-1]

    # -- when it stops by itself -------------------------------------------------

    def _look_after(self, values: Mapping[str, int]) -> None:
        """Note that it has stopped by itself, and that it goes on."""
        left_mode = values["mode"] != MODES.index(self.options.mode)
        self._seen = values
        if left_mode and not self._fallen:
            self._fallen = reason(values)
            self.note(f"stands by itself: {self._fallen}")
        elif self._fallen and not left_mode:
            self._fallen = ""
            self.note("obeys again what it is told")

    # -- what it says ------------------------------------------------------------

    def _readings(self, values: Mapping[str, int]) -> Readings:
        try:
            found: dict[str, Mapping[str, Any]] = {"status": readings.status(values)}
        except IndexError:
            raise WireError(
                f"it says that it is in mode {values['mode']}, and charging in state "
                f"{values['charging']}: there are none such"
            ) from None
        has = self.published()
        state, sensed = readings.state(self._path), readings.sensors(values, self._path)
        found["state"] = readings.only(state, has["state"].paths)
        if "sensors" in has:
            found["sensors"] = readings.only(sensed, has["sensors"].paths)
        return found

    # -- verbs -------------------------------------------------------------------

    def rewind(self) -> None:
        """Be where the experiment starts, from now on; the robot stays where it is."""
        super().rewind()
        state = self.state
        start = tuple(state[path] for path in ("x", "y", "heading"))
        if "_path" not in self.__dict__:
            p = self.parameters
            self._path = Odometer(p.wheel_radius, p.track, COUNTS, WRAP)
        self.perform(lambda: self._path.place(*start))

    @verb
    def beep(self, note: int = 72, seconds: float = 0.25) -> None:
        """Play a note: its number in MIDI, 31 to 127, for at most 4 s."""
        lasts = round(seconds * TEMPO)
        if not (31 <= note <= 127 and 1 <= lasts <= 255):
            raise FieldValueError(
                f"beep({note!r}, {seconds!r}): expected a note of MIDI, 31 to 127 (72 "
                "is a C), and 0.02 to 3.98 s."
            )
        slot = commands.SONGS - 1
        song = commands.song(slot, [(note, lasts)]) + bytes([Op.PLAY, slot])
        self.perform(lambda: self._say(song))

    @verb
    def display(self, text: str) -> None:
        """Show up to four letters on its display, where it has one."""
        shown = text[:4].ljust(4)
        if not (shown.isascii() and shown.isprintable()):
            raise FieldValueError(f"display({text!r}): expected plain ASCII letters.")
        self.perform(lambda: self._say(bytes([Op.DIGITS]) + shown.encode()))


def _asked(values: Mapping[str, int]) -> Speeds:
    """What it says that it was told: right, left, in mm/s."""
    return values["requested_right"], values["requested_left"]


def _stands(values: Mapping[str, int]) -> bool:
    """Whether it says that its wheels do; below Safe mode they always do."""
    return values["mode"] < MODES.index("safe") or _asked(values) == (0, 0)
