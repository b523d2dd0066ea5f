"""OriginalWoodbot: a Woodbot with the first firmware of the class, with its quirks.

Sources: the class's `firmware.ino` (Lab 4), whose server is the Arduino library
arduinoWebSockets; FS90R and ESP32Servo for the wheels.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from math import copysign, degrees

from rems_net.agents.robot import combine
from rems_net.defdict import DefDict
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.emulators.websocket import (
    BINARY,
    GONE,
    OPEN,
    RESET,
    TEXT,
    Packet,
    WebSocketPort,
)
from rems_net.errors import ExperimentError, FabricError, nearest
from rems_net.robots.woodbot import Woodbot

#: Surprising behaviour of this firmware; each quirk can be mended.
QUIRKS = {
    "echo": "a command comes back as text, up to its first 0, whether UTF-8 or not",
    "zeros": "the five bytes of the sensors are always 0",
    "overread": "of a frame that is too short, what was in memory is read",
    "driving": "nothing stops the wheels where no command comes any more",
    "everybody": "if one program leaves, the robot stops for all",
    "starting": "for 6 s after it is switched on it answers nobody",
}
HOSTNAME = "My_Great_Woodbot"
#: Default port (80 is the system's), and the largest number of clients.
PORT, CLIENTS = 8181, 5
#: s. The calls of delay() in its setup().
STARTING = 6.0
#: s. Without a command for so long it stops, if "driving" is mended.
COMMAND_TIMEOUT = 0.5
DRIVE, SENSORS = ord("~"), ord("S")
REST = 90
#: us. Pulses of ESP32Servo at 0 and 180 degrees, and of a servo at rest.
SHORTEST, LONGEST, MIDDLE = 700.0, 2300.0, 1500.0
#: us from the middle. An FS90R stands still up to here (V2.0, data sheet).
DEAD_BAND = 45.0
#: us from the middle. It is fastest from here on. A guess: 400 to 500.
SATURATED = 450.0


def turning(angle: int) -> float:
    """Return the speed of a servo at a commanded angle, -1 to 1; positive CCW."""
    angle = min(max(angle, 0), 180)
    pulse = SHORTEST + angle / 180 * (LONGEST - SHORTEST)
    away = pulse - MIDDLE
    share = (abs(away) - DEAD_BAND) / (SATURATED - DEAD_BAND)
    return copysign(min(max(share, 0.0), 1.0), away)


class OriginalWoodbot:
    """Device that drives by the bytes of clients, and answers as the firmware does.

    mended: the quirks that it does not have.
    """

    baud = 1_000_000
    period = 0.005
    #: Clients that wait to be accepted.
    _waiting: list[int]

    def __init__(self, *, mended: Iterable[str] = ()):
        self.quirks = set(QUIRKS)
        #: Arguments of drive(), newest last: right, left, in degrees.
        self.driven: list[tuple[int, int]] = []
        self._robot = combine(Woodbot, Kinematic)("woodbot")
        self._robot.prepare()
        self._start()
        self._up = STARTING  # it was switched on some time ago
        for quirk in mended:
            self.mend(quirk)

    # -- the methods of a Device ---------------------------------------------------

    @property
    def words(self) -> Mapping[str, Mapping[str, Callable[[], None]]]:
        """Events that can happen to it: a quirk is mended, or comes back."""
        return {
            "mend": {quirk: partial(self.mend, quirk) for quirk in QUIRKS},
            "unmend": {q: partial(self.quirks.add, q) for q in QUIRKS},
        }

    def hear(self, portion: bytes) -> list[bytes]:
        """Take in a packet of a client, and return the answers."""
        packet = Packet.unpack(portion)
        if packet is None:
            return []
        return [one.pack() for one in self._hear(packet)]

    def live(self, dt: float) -> list[bytes]:
        """Move for `dt` seconds; accept the clients that waited while it started."""
        self._up += dt
        self._heard += dt
        moves = self._told != (REST, REST)
        if moves and self._heard > COMMAND_TIMEOUT and "driving" not in self.quirks:
            self._drive(REST, REST)
        self._robot.command = self.wheels
        self._robot.drive(self._robot.command, dt)
        self._robot.sense()
        if not self._answers:
            return []
        waiting, self._waiting = self._waiting, []
        return [one.pack() for client in waiting for one in self._let_in(client)]

    def power(self, on: bool) -> list[bytes]:
        """Lose its battery and its memory (False), or get the battery back (True)."""
        self._start()
        return [Packet(0, RESET).pack()] if on else []

    def status(self) -> str:
        """Return its state in a few words."""
        state, (right, left) = self.state, self._told
        return (
            f"right {right}, left {left} degrees; x {state.x:.2f} m, y {state.y:.2f} "
            f"m, heading {degrees(state.heading):.0f} degrees"
        )

    # -- for tests and people -------------------------------------------------------

    @property
    def state(self) -> DefDict:
        """Position x, y (m) and heading (rad), relative to where it was switched on."""
        return self._robot.state

    @property
    def wheels(self) -> dict[str, float]:
        """Speeds of its wheels, rad/s, positive ahead."""
        top = self._robot.parameters.max_wheel_speed
        # Ahead, the right servo turns clockwise; the left one is mounted mirrored.
        right, left = turning(self._told[0]), turning(180 - self._told[1])
        return {"wheel/left": top * left, "wheel/right": -top * right}

    def mend(self, quirk: str) -> None:
        """Remove a quirk. Raises ExperimentError for an unknown one."""
        if quirk not in QUIRKS:
            raise ExperimentError(
                f"{quirk!r} is no quirk of that firmware; it has {', '.join(QUIRKS)}."
                f"{nearest(quirk, QUIRKS)} (R0716)"
            )
        self.quirks.discard(quirk)

    def _start(self) -> None:
        self._up = self._heard = 0.0
        self._told = (REST, REST)
        #: Client that drove last.
        self._driver: int | None = None
        self._waiting = []
        #: Bytes in memory where the last frame was read.
        self._memory = bytes(4)

    @property
    def _answers(self) -> bool:
        return "starting" not in self.quirks or self._up >= STARTING

    def _hear(self, packet: Packet) -> Iterable[Packet]:
        client = packet.client
        if packet.kind == OPEN:
            if self._answers:
                return self._let_in(client)
            self._waiting.append(client)
        elif packet.kind != GONE:
            return self._frame(packet)
        elif client in self._waiting:
            self._waiting.remove(client)
        elif client == self._driver or "everybody" in self.quirks:
            self._drive(REST, REST)
        return ()

    def _let_in(self, client: int) -> list[Packet]:
        greeting = (b"Connected to ", HOSTNAME.encode())
        return [
            Packet(client, OPEN),
            *(Packet(client, TEXT, text) for text in greeting),
        ]

    def _frame(self, packet: Packet) -> Iterator[Packet]:
        """Yield the answers of the firmware's `switch` to a frame."""
        client, data = packet.client, packet.data
        self._memory = memory = data + bytes(1) + self._memory[len(data) + 1 :]
        drives = memory[0] == DRIVE and (len(data) > 2 or "overread" in self.quirks)
        if packet.kind == BINARY:
            if drives:
                self._drive(memory[1], memory[2], client)
            elif memory[0] == SENSORS:
                yield Packet(client, BINARY, self._sensors())
            if "echo" not in self.quirks:
                return
            # There is no `break`: the firmware then handles the bytes as text, too.
        yield Packet(client, TEXT, memory.partition(b"\0")[0])
        if drives:
            self._drive(memory[1], memory[2], client)
        elif memory[1] == SENSORS:
            yield Packet(client, BINARY, self._sensors())

    def _drive(self, right: int, left: int, client: int | None = None) -> None:
        if client is not None:
            self._driver, self._heard = client, 0.0
        self._told = (right, left)
        self.driven.append(self._told)
        del self.driven[:-1000]

    def _sensors(self) -> bytes:
        """Return five bytes; without the quirk, what the firmware cuts from its
        numbers: lidars in mm, the compass in counts, the gyro in rad/s.
        """
        if "zeros" in self.quirks:
            return bytes(5)
        s = self._robot.sensors
        numbers = (
            *(1e3 * s["lidar/front"], 1e3 * s["lidar/right"]),
            *(750 * s["compass/x"], 750 * s["compass/y"]),
            s["gyro/z"],
        )
        return bytes(int(number) % 256 for number in numbers)


def listening(port: str = "") -> WebSocketPort:
    """Return the server for a port, or for HOST:PORT.

    port: "" for 8181, or for any free port if that is taken; 0 for any free port.
    """
    host, _, number = port.rpartition(":")
    host = host or "127.0.0.1"
    if number and not (number.isdecimal() and int(number) < 65536):
        raise ExperimentError(
            f"--port is {port!r}; expected a port, such as {PORT}, or an address and "
            f"a port, such as 0.0.0.0:{PORT} for all computers of this network. (R0715)"
        )
    if number:
        return WebSocketPort(host, int(number), CLIENTS)
    try:
        return WebSocketPort(host, PORT, CLIENTS)
    except FabricError:
        return WebSocketPort(host, 0, CLIENTS)
