"""EmulatedBus: servos that receive the same packets, and answer in turn."""

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from itertools import zip_longest

from rems_net.drivers.hardware.dynamixel import table
from rems_net.emulators.dynamixel.memory import ACCESS, INSTRUCTION, RESULT
from rems_net.emulators.dynamixel.packet import (
    BROADCAST,
    Instruction,
    Packet,
    Reader,
    status,
)
from rems_net.emulators.dynamixel.servo import Servo

#: Parameters of CLEAR, which brings a position back into one turn.
CLEAR_TURNS = b"\x01\x44\x58\x4c\x22"
#: s. An unfinished packet is dropped after so long.
PACKET_TIMEOUT = 0.02

#: Word -> what happens to a servo.
HAPPENINGS: dict[str, Callable[[Servo], None]] = {
    "overload": lambda servo: servo.fail(0x20),
    "overheat": lambda servo: setattr(servo, "hot", True),
    "cool": lambda servo: setattr(servo, "hot", False),
    "cut": lambda servo: setattr(servo, "there", False),
    "mend": Servo.mend,
    "weaken": lambda servo: setattr(servo, "strong", False),
    "restart": Servo.restart,
}


class EmulatedBus:
    """A chain of servos, as a device for an Emulator.

    baud: bits per second; a servo that is set to another speed receives nothing.
    """

    period = 0.002

    def __init__(self, servos: Iterable[Servo], baud: int):
        self.servos, self.baud = list(servos), baud
        self._reader = Reader()
        self._silent = 0.0
        self._on = True

    @property
    def words(self) -> Mapping[str, Mapping[str, Callable[[], None]]]:
        """Events that can happen to a servo; after each word comes an ID."""
        return {
            word: {str(servo.number): partial(does, servo) for servo in self.servos}
            for word, does in HAPPENINGS.items()
        }

    # -- the methods of a Device --------------------------------------------------

    def hear(self, portion: bytes) -> list[bytes]:
        """Obey the packets that this portion completes; return the answers."""
        self._silent = 0.0
        answers: list[bytes] = []
        for packet in self._reader.feed(portion):
            answers += _collided(self._obey(packet))
        return answers

    def live(self, dt: float) -> list[bytes]:
        """Let `dt` seconds pass. No servo sends anything unasked."""
        self._silent += dt
        if self._silent > PACKET_TIMEOUT:
            self._reader.clear()
        if self._on:
            for servo in self.servos:
                servo.live(dt)
        return []

    def power(self, on: bool) -> list[bytes]:
        """Lose the supply of all servos (False), or get it back (True)."""
        self._on = on
        for servo in self.servos:
            servo.restart()
        return []

    def status(self) -> str:
        """Return its state in a few words."""
        moving = [s for s in self.servos if s.speed]
        return f"{len(self.servos)} servos, {len(moving)} of them move"

    def _obey(self, packet: Packet) -> list[bytes]:
        if packet.instruction == Instruction.STATUS:
            return []
        if not packet.whole:
            hit = [servo for servo in self._hearing() if servo.number == packet.servo]
            return [self._status(servo, table.DAMAGED) for servo in hit]
        many = {
            Instruction.SYNC_READ: self._sync_read,
            Instruction.SYNC_WRITE: self._sync_write,
            Instruction.BULK_READ: self._bulk_read,
            Instruction.BULK_WRITE: self._bulk_write,
        }
        if packet.instruction in many:
            return many[Instruction(packet.instruction)](packet.parameters)
        answers = []
        for servo in self._named(packet.servo):
            answer = self._answer(servo, packet.instruction, packet.parameters)
            if packet.servo != BROADCAST or packet.instruction == Instruction.PING:
                answers += answer
        return answers

    def _answer(self, servo: Servo, instruction: int, given: bytes) -> list[bytes]:
        """Have one servo do it; return its answer, or nothing if it does not answer."""
        memory = servo.memory
        level = memory[table.STATUS_RETURN]
        if instruction == Instruction.PING:
            _, model = memory.read(table.MODEL.address, table.MODEL.size)
            firmware = bytes([memory[table.FIRMWARE]])
            return [self._status(servo, 0, model + firmware)]
        if instruction == Instruction.READ:
            servo.show()
            error, data = memory.read(*_place(given))
            return [self._status(servo, error, data)] if level else []
        error = self._do(servo, instruction, given)
        return [self._status(servo, error)] if level == 2 else []

    def _do(self, servo: Servo, instruction: int, given: bytes) -> int:
        """Have one servo do what has no answer but an error; return that, or 0."""
        match instruction:
            case Instruction.WRITE | Instruction.REG_WRITE:
                address = int.from_bytes(given[:2], "little")
                error, values = servo.memory.write(address, given[2:])
                if instruction == Instruction.WRITE:
                    servo.obey(values)
                elif not error:
                    servo.waiting = values
                    servo.memory[table.REGISTERED] = 1
                return error
            case Instruction.ACTION:
                if not servo.waiting:
                    return INSTRUCTION
                servo.obey(servo.waiting)
                servo.waiting = {}
                servo.memory[table.REGISTERED] = 0
            case Instruction.REBOOT:
                servo.restart()
            case Instruction.CLEAR:
                if given != CLEAR_TURNS:
                    return INSTRUCTION
                if servo.speed:
                    return RESULT
                servo.position %= table.TURN
            case Instruction.FACTORY_RESET:
                return ACCESS  # its ID and speed would change
            case _:
                return INSTRUCTION
        return 0

    def _sync_read(self, given: bytes) -> list[bytes]:
        place, ids = given[:4], given[4:]
        asked = ((number, place) for number in ids)
        return self._read_each(asked)

    def _bulk_read(self, given: bytes) -> list[bytes]:
        asked = (given[at : at + 5] for at in range(0, len(given) - 4, 5))
        return self._read_each((one[0], one[1:]) for one in asked)

    def _read_each(self, asked: Iterable[tuple[int, bytes]]) -> list[bytes]:
        found: list[bytes] = []
        for number, place in asked:
            for servo in self._named(number):
                found += self._answer(servo, Instruction.READ, place)
        return found

    def _sync_write(self, given: bytes) -> list[bytes]:
        address, size = _place(given)
        step = size + 1
        for at in range(4, len(given) - size, step):
            self._write(given[at], address, given[at + 1 : at + step])
        return []

    def _bulk_write(self, given: bytes) -> list[bytes]:
        at = 0
        while at + 5 <= len(given):
            address, size = _place(given[at + 1 :])
            self._write(given[at], address, given[at + 5 : at + 5 + size])
            at += 5 + size
        return []

    def _write(self, number: int, address: int, data: bytes) -> None:
        for servo in self._named(number):
            servo.obey(servo.memory.write(address, data)[1])

    def _hearing(self) -> list[Servo]:
        """Return the servos that receive packets at this speed, in the order of IDs."""
        code = table.BAUDS[self.baud]
        hear = [s for s in self.servos if s.hears and s.memory[table.BAUD] == code]
        return sorted(hear, key=lambda servo: servo.number)

    def _named(self, number: int) -> list[Servo]:
        """Return those of this ID, or all, that receive, and reset their watchdogs."""
        found = [s for s in self._hearing() if number in (s.number, BROADCAST)]
        for servo in found:
            servo.heard()
        return found

    def _status(self, servo: Servo, error: int, data: bytes = b"") -> bytes:
        alert = table.ALERT if servo.memory[table.HARDWARE_ERROR] else 0
        return status(servo.number, error | alert, data)


def _collided(answers: list[bytes]) -> list[bytes]:
    """Return what is received if servos with one ID answer at once: zeros win."""
    heard: dict[int, bytes] = {}
    for answer in answers:
        number = answer[4]
        both = zip_longest(answer, heard.get(number, answer), fillvalue=255)
        heard[number] = bytes(a & b for a, b in both)
    return list(heard.values())


def _place(given: bytes) -> tuple[int, int]:
    """Return the address and the size at the beginning of the parameters."""
    return int.from_bytes(given[:2], "little"), int.from_bytes(given[2:4], "little")
