"""OriginalFirmware: drives a Woodbot with the first firmware of the class, over Wi-Fi.

The firmware's messages and its surprises are in `docs/hardware.md`.
"""

from collections.abc import Callable, Mapping
from contextlib import suppress
from math import copysign
from threading import Event
from typing import Any, ClassVar
from urllib.parse import urlsplit

from rems_net.agents.ports import Settings
from rems_net.agents.wall import wall
from rems_net.defdict import DefDict, Field, ratio, text
from rems_net.drivers.hardware.driven import Driven, NoDeviceError
from rems_net.drivers.hardware.held import HeldSocket
from rems_net.drivers.hardware.websocket import EXTRA, Message, WebSocket, framed
from rems_net.drivers.needs import missing
from rems_net.errors import SchemaError
from rems_net.libraries import look_for

#: s. A robot answers 6 s after it is switched on, and joins the Wi-Fi before.
STARTING = 8.0
#: s between two attempts in that time
PAUSE = 0.25
#: s. Longest later attempt: less than `max_age`, or the call is reported as hanging.
LATER = 0.45
#: s. Least time to wait for the greeting, which comes with the connection.
GREETING = 0.2
#: commands for the wheels, and for the sensors: the reply is five bytes, always 0
DRIVE, SENSORS = b"~", b"S"
#: degrees. Angle of a servo that stands still; full speed is this much away from it.
REST = 90
READINGS = 5
WHEELS = ("wheel/left", "wheel/right")


class OriginalFirmware(Driven):
    """Driver of a Woodbot that runs the class's first firmware.

    That firmware measures nothing: `state` is computed from the commands, and `sensors`
    do not change. The robot goes on driving if Wi-Fi fails. So that it stops if this
    program ends, another process holds the connection.
    """

    options = Settings(
        Driven.options.fields,
        url=text(doc="where it is: ws://192.168.8.200"),
        hostname=text(doc="of the robot that is meant, as it greets; any if empty"),
        dead_band=ratio(
            default=0.0,
            range=(0, 0.5),
            doc="how far a servo can be turned up until its wheel moves",
        ),
        saturation=ratio(
            default=1.0,
            range=(0.1, 1),
            doc="how far it is turned up when its wheel is as fast as it gets",
        ),
    )
    needs = ("websockets",)
    rate = 20.0
    #: s. A reply must come within this.
    timeout: ClassVar[float] = 0.25

    line: WebSocket | None = None
    #: the process that holds the connection, since the first connection
    _held: HeldSocket
    _reached = False
    #: number of the newest exchange
    _number = 0
    _path: DefDict
    _rates: Callable[[DefDict, DefDict], Mapping[str, Any]]
    #: the wheels' command, rad/s, and the wall time since which they obey it, s
    _told: tuple[DefDict, float] | None = None

    def prepare(self) -> None:
        look_for("websockets", EXTRA)
        super().prepare()
        _check_url(self.options.url)
        rates = getattr(self, "derivative", None)
        if not callable(rates):
            raise missing(
                self,
                "derivative(state, command)",
                "where its wheels bring it, since it measures nothing",
                'def derivative(self, state, command):\n        return {"x": 0.0}',
            )
        self._rates = rates
        for path in WHEELS:
            self._top(path)
        if not self.options.dead_band < self.options.saturation:
            raise SchemaError(
                f"dead_band is {self.options.dead_band:g} and saturation "
                f"{self.options.saturation:g}; expected a dead_band below "
                "saturation. (R0309)"
            )

    def open(self) -> None:
        """Connect to the robot, and warn of what its firmware cannot do."""
        self._held = HeldSocket()
        super().open()
        self._warn(
            f"{self.key} reckons its state from its commands. It drives on where Wi-Fi "
            "fails, so stay near its switch"
        )

    def close(self) -> None:
        """Stop the robot, and end the process that holds the connection."""
        try:
            super().close()
        finally:
            if "_held" in self.__dict__:
                self._held.end()

    def rewind(self) -> None:
        """Reset the state; it is computed from there on."""
        super().rewind()
        start = self.state.copy()
        self.perform(lambda: self._begin(start))

    # -- in the device thread ------------------------------------------------------

    def connect(self) -> None:
        """Connect to the robot; the first time, wait as long as it takes to start."""
        self._held.start()
        until = wall() + (LATER if self._reached else STARTING)
        while True:
            try:
                left = until - wall()
                self.line = WebSocket.connect(self.options.url, left, self._held.reach)
                break
            except OSError as error:
                if wall() + PAUSE >= until:
                    raise NoDeviceError(self._nobody(error)) from error
            Event().wait(PAUSE)
        self._held.arm(self.max_age, framed(DRIVE + bytes([REST, REST])))
        self._greet(self.line, max(until, wall() + GREETING))
        self._reached = True

    def disconnect(self) -> None:
        """Close the connection; the robot stops then, even if others drive it, too."""
        line, self.line, self._told = self.line, None, None
        if line is not None:
            line.close()

    def exchange(self, command: DefDict) -> dict[str, Any]:
        """Send both wheels' speeds and a number, and wait until the number comes back.

        The number comes back when both commands were obeyed. Other messages are
        ignored: echoes of commands end at their first 0, and name no command.
        """
        line = self.line
        if line is None:
            raise OSError("not connected")
        self._number += 1
        number = f"#{self._number}".encode()
        line.send(DRIVE + self._servo(command, "right") + self._servo(command, "left"))
        line.send(number, text=True)
        self._go_on(command)
        until = wall() + self.timeout
        while line.receive(until - wall()).data != number:
            pass
        return {"state": self._path}

    def is_still(self) -> bool:
        return True  # it has repeated the number behind its command

    def explain(self, error: OSError) -> str:
        """Explain an error of the system as the end of the connection."""
        why = error.errno and f"the connection ended: {error.strerror}"
        return why or ""

    def _greet(self, line: WebSocket, until: float) -> None:
        """Check that a Woodbot answers, and the right one. Raises NoDeviceError.

        The robot sends `Connected to `, then its name in another message; it answers
        the command for its sensors with five bytes.
        """
        line.send(SENSORS)
        said: list[Message] = []
        with suppress(TimeoutError):
            while not said or said[-1].text:
                said.append(line.receive(until - wall()))
        if not said or said[-1].text or len(said[-1].data) != READINGS:
            came = ", ".join(repr(one.data[:20]) for one in said) or "nothing"
            raise NoDeviceError(
                f"what answers at {self.options.url} is no Woodbot with the class's "
                f"first firmware: asked for its sensors, it sent {came}. Check the "
                "address and the port"
            )
        name = said[1].data.decode(errors="replace") if len(said) > 2 else "nameless"
        if self.options.hostname not in ("", name):
            raise NoDeviceError(
                f"{self.options.url} is {name!r}, and {self.options.hostname!r} is "
                "meant. It may have another address today: the router's list of who is "
                "in the Wi-Fi shows it"
            )

    def _nobody(self, error: OSError) -> str:
        """Return the error's message: the fault, and the user's checks in order."""
        host = urlsplit(self.options.url).hostname
        return (
            f"no Woodbot answers at {self.options.url}: {error.strerror or error}. "
            "Check, in this order: 1. that it has been switched on for 10 s; 2. that "
            f"this computer is in its Wi-Fi; 3. that it is there: ping {host}; 4. that "
            "the port is right, 80 in the class; 5. that it has no more than five "
            "clients, you among them"
        )

    def _servo(self, command: DefDict, side: str) -> bytes:
        """Return a servo's angle: 90 stands, 0 is full speed ahead, 180 back."""
        path = f"wheel/{side}"
        share = command[path] / self._top(path)
        low, high = self.options.dead_band, self.options.saturation
        turned = low + (high - low) * abs(share) if share else 0.0
        return bytes([REST - round(copysign(REST * turned, share))])

    def _top(self, path: str) -> float:
        """Return a wheel's speed at 100 %: the end of the range in the command."""
        schema = self.command.schema
        field = schema.find(path)
        if not isinstance(field, Field) or field.unit != "rad/s" or not field.range:
            raise SchemaError(
                f"{type(self).__name__} needs a command with wheel/left and "
                "wheel/right, such as angular_velocity(range=(-7, 7)): the end of the "
                f"range is the speed at 100 %. {schema.name} has {path!r} "
                "without that unit or without a range. (R0306)"
            )
        return float(field.range[1])

    def _begin(self, start: DefDict) -> None:
        self._path, self._told = start, None

    def _go_on(self, command: DefDict) -> None:
        """Compute the state up to now; from now on the wheels obey `command`."""
        now = wall()
        if self._told is not None:
            told, since = self._told
            path, dt = self._path, now - since
            half = path.copy()
            self._add(half, self._rates(path, told), dt / 2)
            self._add(path, self._rates(half, told), dt)
        self._told = command.copy(), now

    def _add(self, path: DefDict, rates: Mapping[str, Any], dt: float) -> None:
        for field, rate in rates.items():
            path[field] += rate * dt


def _check_url(url: str) -> None:
    """Raise SchemaError for a URL that cannot be the address of a robot."""
    split = urlsplit(url)
    with suppress(ValueError):  # a port that is no number
        if split.scheme == "ws" and split.hostname and split.port != 0:
            return
    raise SchemaError(
        f"url is {url!r}; expected where the robot is, such as "
        'options = { url = "ws://192.168.8.200" }, or with a port, '
        '"ws://192.168.4.1:81". (R0309)'
    )
