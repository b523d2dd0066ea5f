"""Interface: the Open Interface of an emulated Create 2, byte by byte."""

from math import degrees

from rems_net.drivers.hardware.create2 import commands, packets
from rems_net.drivers.hardware.create2.commands import BAUDS, TEMPO, TOP_SPEED, Op
from rems_net.drivers.hardware.create2.packets import MODES, PACKETS
from rems_net.drivers.hardware.create2.stream import frame
from rems_net.emulators.create2.body import Body

OFF, PASSIVE, SAFE, FULL = range(len(MODES))
#: Commands that are obeyed in Safe and Full mode only.
ACTS = {
    *(Op.DRIVE, Op.DRIVE_DIRECT, Op.DRIVE_PWM, Op.MOTORS, Op.PWM_MOTORS, Op.PLAY),
    *(Op.LEDS, Op.SCHEDULING_LEDS, Op.DIGITS_RAW, Op.DIGITS),
}
#: Commands that lead to Passive mode.
PASSES = (Op.START, Op.SPOT, Op.CLEAN, Op.MAX, Op.DOCK)
#: mm. Radii that mean straight on, and in place.
STRAIGHT, IN_PLACE = (-0x8000, 0x7FFF), (-1, 1)
#: s. Passive mode sleeps after so long without a command.
SLEEPS = 300.0


class Interface:
    """Interpreter of commands: it keeps the mode and sends the sensors' values.

    baud: bits per second, until a command changes it.
    """

    def __init__(self, body: Body):
        self.body = body
        self.baud = BAUDS[-1]
        #: Commands that it obeyed, newest last: the opcode, and its data.
        self.done: list[tuple[Op, bytes]] = []
        #: by how much it reports its mode too high
        self.too_high = 0
        self.restart()

    def restart(self) -> None:
        """Switch off, and forget everything."""
        self.mode, self.resets = OFF, False
        self.stream: tuple[int, ...] = ()
        self.streams = False
        self.songs: dict[int, float] = {}
        self.song, self.plays = 0, 0.0
        self.display = ""
        self.velocity = self.radius = 0
        self._idle = 0.0
        self._buffer = b""
        self.body.restart()
        self._from = self._pose()
        self.look()

    def hear(self, portion: bytes) -> list[bytes]:
        """Obey all complete commands; the rest waits until it is complete."""
        self._buffer += portion
        answers: list[bytes] = []
        while self._buffer:
            size = commands.length(self._buffer)
            if size == 0:  # unknown command
                self._buffer = self._buffer[1:]
            elif size > len(self._buffer):
                break
            else:
                command, self._buffer = self._buffer[:size], self._buffer[size:]
                answers += self._obey(Op(command[0]), command[1:])
        return answers

    def tick(self, dt: float) -> list[bytes]:
        """Read the sensors, every 15 ms; return the packets of the stream."""
        self.plays = max(0.0, self.plays - dt)
        self._idle += dt
        if self.mode == PASSIVE and self._idle > SLEEPS:
            self.mode = OFF
        body = self.body
        in_danger = body.over_nothing or body.lifted or body.charger
        if self.mode == SAFE and in_danger:
            self._stand(PASSIVE)
        self.look()
        if not (self.streams and self.stream) or self.mode == OFF:
            return []
        values = dict(pair for number in self.stream for pair in self._read(number))
        return [frame(self.stream, values)]

    def look(self) -> None:
        """Read the sensors; the values hold until the next call."""
        self._values = dict.fromkeys((name for name, _ in PACKETS.values()), 0)
        self._values |= self.body.values()
        self._values |= {
            "mode": self.mode + self.too_high,
            "song": self.song,
            "song_playing": int(self.plays > 0),
            "stream_packets": len(self.stream),
            "requested_velocity": self.velocity,
            "requested_radius": self.radius,
            "requested_right": self.body.right,
            "requested_left": self.body.left,
        }

    def _obey(self, op: Op, data: bytes) -> list[bytes]:
        self._idle = 0.0
        if op is Op.RESET:
            self.resets, self._buffer = True, b""
        if self.mode == OFF and op is not Op.START:
            return []
        if op in ACTS and self.mode < SAFE:
            return []
        self.done.append((op, data))
        del self.done[:-1000]
        if op in PASSES:
            self._stand(PASSIVE)
        elif op in (Op.STOP, Op.POWER):
            self._stand(OFF)
        elif op in (Op.SAFE, Op.CONTROL):
            self.mode = SAFE
        elif op is Op.FULL:
            self.mode = FULL
        elif op in (Op.SENSORS, Op.QUERY, Op.STREAM, Op.PAUSE):
            return self._tell(op, data)
        else:
            self._act(op, data)
        return []

    def _act(self, op: Op, data: bytes) -> None:
        match op:
            case Op.BAUD if data[0] < len(BAUDS):
                self.baud = BAUDS[data[0]]
            case Op.DRIVE:
                self._drive(_signed(data[:2]), _signed(data[2:]))
            case Op.DRIVE_DIRECT:
                self._turn(_signed(data[:2]), _signed(data[2:]))
            case Op.DRIVE_PWM:
                full = TOP_SPEED / 255
                right, left = _signed(data[:2]), _signed(data[2:])
                self._turn(round(right * full), round(left * full))
            case Op.SONG if data[0] < commands.SONGS:
                self.songs[data[0]] = sum(data[3::2]) / TEMPO
            case Op.PLAY if data[0] in self.songs:
                self.song, self.plays = data[0], self.songs[data[0]]
            case Op.DIGITS:
                self.display = data.decode("ascii", "replace")

    def _drive(self, velocity: int, radius: int) -> None:
        """Drive a curve: mm/s, and radius to its middle in mm, positive to the left."""
        self.velocity, self.radius = velocity, radius
        if radius in STRAIGHT:
            self._turn(velocity, velocity)
        elif radius in IN_PLACE:
            self._turn(radius * velocity, -radius * velocity)
        elif radius:
            side = 1000 * self.body.robot.parameters.track / 2 / radius
            self._turn(round(velocity * (1 + side)), round(velocity * (1 - side)))

    def _turn(self, right: int, left: int) -> None:
        top = TOP_SPEED
        self.body.right, self.body.left = _within(right, top), _within(left, top)

    def _stand(self, mode: int) -> None:
        self.mode = mode
        self.body.right = self.body.left = self.velocity = 0

    def _tell(self, op: Op, data: bytes) -> list[bytes]:
        match op:
            case Op.PAUSE:
                self.streams = bool(data[0])
            case Op.STREAM:
                self.stream = tuple(n for n in data[1:] if _known(n))
                self.streams = bool(self.stream)
            case _:
                asked = data if op is Op.SENSORS else data[1:]
                known = filter(_known, asked)
                return [b"".join(packets.pack(n, dict(self._read(n))) for n in known)]
        return []

    def _read(self, number: int) -> list[tuple[str, int]]:
        """Return the values of a packet; distance and angle count anew when read."""
        found = []
        for member in packets.members(number):
            name = PACKETS[member][0]
            if name in ("distance", "angle"):
                self._values[name] = self._since(name)
            found.append((name, self._values[name]))
        return found

    def _since(self, name: str) -> int:
        """Return whole mm, or degrees counter-clockwise, since the last reading."""
        here = self._pose()
        moved = here[name] - self._from[name]
        whole = _within(int(moved), 0x7FFF)
        self._from[name] += whole
        return whole

    def _pose(self) -> dict[str, float]:
        """Return the way of its centre, mm, and its heading, degrees."""
        robot = self.body.robot
        state, p = robot.state, robot.parameters
        wheels = state["wheel/left"] + state["wheel/right"]
        return {
            "distance": 1000 * p.wheel_radius * wheels / 2,
            "angle": degrees(state["heading"]),
        }


def _known(number: int) -> bool:
    return number in PACKETS or number in packets.GROUPS


def _signed(data: bytes) -> int:
    return int.from_bytes(data, "big", signed=True)


def _within(value: int, most: int) -> int:
    return max(-most, min(most, value))
