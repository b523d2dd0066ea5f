"""What emulated servos obey and refuse: the rules of the control table."""

from importlib.resources import files
from math import pi

import pytest
from hypothesis import given, settings, strategies as st

from rems_net.drivers.hardware.dynamixel import table
from rems_net.drivers.hardware.dynamixel.table import Register
from rems_net.emulators.dynamixel.bus import EmulatedBus
from rems_net.emulators.dynamixel.memory import ACCESS, LENGTH, LIMIT, RANGE
from rems_net.emulators.dynamixel.packet import Instruction, Packet, Reader, encode
from rems_net.emulators.dynamixel.servo import STARTS, Servo

EVERYBODY = 0xFE


def servos() -> EmulatedBus:
    """Servos 1 and 2, which were never touched, at a million bits per second."""
    return EmulatedBus([Servo({table.BAUD: 3, table.ID: i}) for i in (1, 2)], 1_000_000)


@pytest.fixture
def bus() -> EmulatedBus:
    return servos()


def heard(bus: EmulatedBus, servo: int, what: int, given: bytes = b"") -> list[Packet]:
    return Reader().feed(b"".join(bus.hear(encode(servo, what, given))))


def tell(bus: EmulatedBus, servo: int, what: int, given: bytes = b"") -> bytes:
    """The one answer of one servo: its error, and parameters."""
    [answer] = heard(bus, servo, what, given)
    assert (answer.servo, answer.instruction) == (servo, Instruction.STATUS)
    return answer.parameters


def place(register: Register, size: bool = False) -> bytes:
    at = register.address.to_bytes(2, "little")
    return at + register.size.to_bytes(2, "little") if size else at


def write(bus: EmulatedBus, register: Register, value: int) -> int:
    """Write it to servo 1, and return the error."""
    return tell(bus, 1, Instruction.WRITE, place(register) + register.pack(value))[0]


def read(bus: EmulatedBus, register: Register, servo: int = 1) -> int:
    error, *data = tell(bus, servo, Instruction.READ, place(register, size=True))
    assert error & 0x7F == 0
    return register.unpack(bytes(data))


def live(bus: EmulatedBus, seconds: float) -> None:
    for _ in range(round(seconds / bus.period)):
        assert bus.live(bus.period) == []


def turn(bus: EmulatedBus, counts: int) -> None:
    """Bring servo 1 to turn."""
    assert write(bus, table.OPERATING_MODE, table.VELOCITY_MODE) == 0
    assert write(bus, table.TORQUE, 1) == 0
    assert write(bus, table.GOAL_VELOCITY, counts) == 0


def test_ping(bus: EmulatedBus) -> None:
    assert tell(bus, 1, Instruction.PING) == b"\0" + (1060).to_bytes(2, "little") + b"-"
    assert [p.servo for p in heard(bus, EVERYBODY, Instruction.PING)] == [1, 2]
    assert heard(bus, 7, Instruction.PING) == []


def test_settings_are_written_without_torque(bus: EmulatedBus) -> None:
    assert write(bus, table.TORQUE, 1) == 0
    assert write(bus, table.OPERATING_MODE, table.VELOCITY_MODE) == ACCESS
    assert read(bus, table.OPERATING_MODE) == table.POSITION_MODE
    assert write(bus, table.TORQUE, 0) == 0
    assert write(bus, table.OPERATING_MODE, table.VELOCITY_MODE) == 0
    assert read(bus, table.OPERATING_MODE) == table.VELOCITY_MODE


@pytest.mark.parametrize(
    ("register", "value", "error"),
    [
        (table.PRESENT_POSITION, 0, ACCESS),
        (Register(60_000, 1), 0, ACCESS),
        (Register(66, 1), 0, ACCESS),
        (table.TORQUE, 2, RANGE),
        (table.WATCHDOG, -1, RANGE),
        (table.OPERATING_MODE, 2, RANGE),
        (table.GOAL_VELOCITY, 266, LIMIT),
        (table.GOAL_VELOCITY, -266, LIMIT),
        (table.GOAL_POSITION, 4096, LIMIT),
        (Register(table.GOAL_VELOCITY.address, 2), 1, LENGTH),
    ],
)
def test_refused(bus: EmulatedBus, register: Register, value: int, error: int) -> None:
    assert write(bus, register, value) == error


def test_several_registers_at_once_all_or_none(bus: EmulatedBus) -> None:
    first = place(table.PROFILE_ACCELERATION) + table.PROFILE_ACCELERATION.pack(7)
    beyond = first + table.PROFILE_VELOCITY.pack(999)
    assert tell(bus, 1, Instruction.WRITE, beyond)[0] == LIMIT
    assert read(bus, table.PROFILE_ACCELERATION) == 0
    fits = first + table.PROFILE_VELOCITY.pack(9)
    assert tell(bus, 1, Instruction.WRITE, fits)[0] == 0
    assert read(bus, table.PROFILE_ACCELERATION) == 7
    assert read(bus, table.PROFILE_VELOCITY) == 9


def test_it_turns_as_fast_as_it_is_told(bus: EmulatedBus) -> None:
    """0.229 revolutions per minute a count; a turn is 4096 counts."""
    turn(bus, 83)
    live(bus, 1.0)
    assert read(bus, table.PRESENT_VELOCITY) == 83
    turned = 83 * 0.229 / 60 * 4096
    assert read(bus, table.PRESENT_POSITION) == pytest.approx(2048 + turned, abs=1)
    assert write(bus, table.GOAL_VELOCITY, -83) == 0
    live(bus, 1.0)
    assert read(bus, table.PRESENT_VELOCITY) == -83
    assert read(bus, table.PRESENT_POSITION) == pytest.approx(2048, abs=2)
    assert write(bus, table.TORQUE, 0) == 0
    live(bus, 0.1)
    assert read(bus, table.PRESENT_VELOCITY) == 0


def test_it_goes_past_a_turn_in_extended_mode(bus: EmulatedBus) -> None:
    assert write(bus, table.OPERATING_MODE, table.EXTENDED_MODE) == 0
    assert write(bus, table.GOAL_POSITION, 10_000) == 0
    assert write(bus, table.TORQUE, 1) == 0
    live(bus, 3.0)
    assert read(bus, table.PRESENT_POSITION) == 10_000
    # At most as fast as its motor: 61 revolutions per minute.
    assert write(bus, table.GOAL_POSITION, 0) == 0
    live(bus, 1.0)
    gone = (10_000 - read(bus, table.PRESENT_POSITION)) * 2 * pi / 4096
    assert gone == pytest.approx(61 * pi / 30, rel=0.01)
    tell(bus, 1, Instruction.REBOOT)
    live(bus, STARTS + 0.05)
    assert 0 <= read(bus, table.PRESENT_POSITION) < 4096


def test_reversed_it_counts_the_other_way_round(bus: EmulatedBus) -> None:
    assert write(bus, table.DRIVE_MODE, table.REVERSE) == 0
    turn(bus, 100)
    live(bus, 0.5)
    assert bus.servos[0].radians < 0
    assert read(bus, table.PRESENT_VELOCITY) == 100


def test_the_watchdog_stops_it_until_it_is_let_go(bus: EmulatedBus) -> None:
    turn(bus, 100)
    assert write(bus, table.WATCHDOG, 25) == 0
    for _ in range(4):  # it is spoken to
        live(bus, 0.4)
        assert read(bus, table.PRESENT_VELOCITY) == 100
    for _ in range(2):  # the other one is spoken to
        live(bus, 0.4)
        read(bus, table.PRESENT_VELOCITY, servo=2)
    assert read(bus, table.PRESENT_VELOCITY) == 0
    assert read(bus, table.WATCHDOG) == -1
    assert write(bus, table.GOAL_VELOCITY, 50) == RANGE
    assert read(bus, table.GOAL_VELOCITY) == 100
    assert write(bus, table.WATCHDOG, 0) == 0
    assert write(bus, table.GOAL_VELOCITY, 50) == 0
    live(bus, 0.1)
    assert read(bus, table.PRESENT_VELOCITY) == 50


def test_overloaded_it_lets_go_and_says_so(bus: EmulatedBus) -> None:
    turn(bus, 100)
    bus.words["overload"]["1"]()
    live(bus, 0.1)
    assert bus.servos[0].speed == 0
    assert tell(bus, 1, Instruction.PING)[0] == table.ALERT
    assert tell(bus, 2, Instruction.PING)[0] == 0
    assert read(bus, table.HARDWARE_ERROR) == 0x20
    write(bus, table.TORQUE, 1)
    assert read(bus, table.TORQUE) == 0
    tell(bus, 1, Instruction.REBOOT)
    assert heard(bus, 1, Instruction.PING) == [], "it starts"
    live(bus, STARTS + 0.05)
    assert tell(bus, 1, Instruction.PING)[0] == 0
    assert read(bus, table.OPERATING_MODE) == table.VELOCITY_MODE, "it is kept"
    assert read(bus, table.GOAL_VELOCITY) == 0


def test_many_at_once(bus: EmulatedBus) -> None:
    speed = table.PROFILE_VELOCITY
    at = place(speed, size=True)
    goals = b"\1" + speed.pack(5) + b"\2" + speed.pack(6)
    assert heard(bus, EVERYBODY, Instruction.SYNC_WRITE, at + goals) == []
    answers = heard(bus, EVERYBODY, Instruction.SYNC_READ, at + b"\2\1\7")
    values = [(p.servo, speed.unpack(p.parameters[1:])) for p in answers]
    assert values == [(2, 6), (1, 5)], "in the order in which they are asked"
    led = place(table.LED, size=True)
    bulk = b"\1" + at + speed.pack(8) + b"\2" + led + b"\1"
    assert heard(bus, EVERYBODY, Instruction.BULK_WRITE, bulk) == []
    assert (read(bus, speed), read(bus, table.LED, servo=2)) == (8, 1)
    answers = heard(bus, EVERYBODY, Instruction.BULK_READ, b"\1" + at + b"\2" + led)
    found = [(p.servo, p.parameters[1:]) for p in answers]
    assert found == [(1, speed.pack(8)), (2, b"\1")]


def test_written_now_done_later(bus: EmulatedBus) -> None:
    assert tell(bus, 1, Instruction.ACTION)[0] != 0, "nothing waits"
    assert tell(bus, 1, Instruction.REG_WRITE, place(table.LED) + b"\1")[0] == 0
    assert (read(bus, table.LED), read(bus, table.REGISTERED)) == (0, 1)
    assert heard(bus, EVERYBODY, Instruction.ACTION) == []
    assert (read(bus, table.LED), read(bus, table.REGISTERED)) == (1, 0)


def test_who_answers_what(bus: EmulatedBus) -> None:
    light = place(table.LED) + b"\1"
    bus.servos[0].memory[table.STATUS_RETURN] = 1
    assert heard(bus, 1, Instruction.WRITE, light) == []
    assert read(bus, table.LED) == 1
    bus.servos[0].memory[table.STATUS_RETURN] = 0
    assert heard(bus, 1, Instruction.READ, place(table.LED, size=True)) == []
    assert tell(bus, 1, Instruction.PING)[0] == 0


def test_the_wrong_speed_is_not_heard(bus: EmulatedBus) -> None:
    write(bus, table.BAUD, 1)
    assert heard(bus, 1, Instruction.PING) == []
    assert tell(bus, 2, Instruction.PING)[0] == 0


def test_a_damaged_packet_is_not_obeyed(bus: EmulatedBus) -> None:
    damaged = bytearray(encode(1, Instruction.WRITE, place(table.LED) + b"\1"))
    damaged[10] ^= 2
    [answer] = Reader().feed(b"".join(bus.hear(bytes(damaged))))
    assert answer.parameters == bytes([table.DAMAGED])
    assert read(bus, table.LED) == 0


def test_half_a_packet_is_given_up(bus: EmulatedBus) -> None:
    half = encode(1, Instruction.WRITE, place(table.LED) + b"\1")[:-3]
    assert bus.hear(half) == []
    live(bus, 0.05)
    assert tell(bus, 1, Instruction.PING)[0] == 0


bytes_of = st.binary(max_size=24)
anything = st.tuples(st.integers(0, 254), st.integers(0, 255), bytes_of)


@settings(max_examples=50)
@given(st.lists(anything | bytes_of, max_size=8))
def test_nothing_that_is_said_breaks_it(
    said: list[tuple[int, int, bytes] | bytes],
) -> None:
    bus = servos()
    for one in said:
        data = one if isinstance(one, bytes) else encode(*one)
        for answer in bus.hear(data):
            [packet] = Reader().feed(answer)
            assert packet.instruction == Instruction.STATUS
        bus.live(bus.period)


def test_the_table_is_the_one_of_the_sdk() -> None:
    """Of each model: its number, its addresses, and the units of rotation."""
    pytest.importorskip(
        "dynamixel_easy_sdk", reason="this version of dynamixel-sdk has no tables"
    )
    folder = files("dynamixel_easy_sdk") / "control_table"
    listed = (folder / "dynamixel.model").read_text("utf-8").splitlines()[1:]
    numbers = {int(n): file for n, file in (line.split("\t") for line in listed)}
    ours = {v for v in vars(table).values() if isinstance(v, Register)}
    ours.remove(table.PROFILE_AND_GOAL)
    assert len(ours) > 30
    for number, name in table.MODELS.items():
        assert numbers[number] == f"{name.lower().replace('-', '_')}.model"
        text = (folder / numbers[number]).read_text("utf-8")
        head, _, lines = text.partition("[control table]")
        rows = [line.split("\t") for line in lines.splitlines()[2:]]
        known = {int(address): int(size) for address, size, _ in rows}
        own = set(ours)
        if "\tCurrent Limit" not in lines:  # only servos that measure it have one
            own -= {table.CURRENT_LIMIT, table.GOAL_CURRENT}
        assert {r.address: r.size for r in own}.items() <= known.items(), name
        values = {
            row[0]: row[1] for row in map(str.split, head.splitlines()) if row[1:]
        }
        assert int(values["value_of_zero_radian_position"]) == table.TURN // 2
        assert int(values["value_of_max_radian_position"]) == table.TURN - 1
        unit = next(x for x in head.splitlines() if x.startswith("Goal Velocity"))
        assert float(unit.split("\t")[1]) == pytest.approx(table.VELOCITY, rel=1e-3)


@pytest.mark.parametrize("name", ["XH430-V350", "XH430-V210"])
def test_servos_for_24_v_are_known(name: str) -> None:
    assert name in table.MODELS.values()
