"""The emulated Create 2 against the published tables of the Open Interface."""

import struct
from math import pi

import pytest
from hypothesis import given, settings, strategies as st

from rems_net.drivers.hardware.create2 import commands, packets
from rems_net.drivers.hardware.create2.commands import Op
from rems_net.drivers.hardware.create2.stream import Stream, frame
from rems_net.emulators.create2.body import Body
from rems_net.emulators.create2.device import BANNER, Create2Device
from rems_net.emulators.create2.interface import FULL, OFF, PASSIVE, SAFE, Interface

START, TO_SAFE, TO_FULL = bytes([Op.START]), bytes([Op.SAFE]), bytes([Op.FULL])
TICK = 0.015


def interface(*said: bytes) -> Interface:
    made = Interface(Body())
    for one in said:
        made.hear(one)
    return made


def sensed(of: Interface, number: int) -> dict[str, int]:
    (reply,) = of.hear(bytes([Op.SENSORS, number]))
    return packets.unpack(number, reply)


def on(of: Interface, seconds: float) -> list[bytes]:
    """Let so much time pass, a tick after the other."""
    said = []
    for _ in range(round(seconds / TICK)):
        of.body.move(TICK)
        said += of.tick(TICK)
    return said


# -- the tables ------------------------------------------------------------------


def test_groups_have_the_published_sizes() -> None:
    published = {0: 26, 1: 10, 2: 6, 3: 10, 4: 14, 5: 12, 6: 52}
    published |= {100: 80, 101: 28, 106: 12, 107: 9}
    assert {n: packets.form(n).size for n in packets.GROUPS} == published


@pytest.mark.parametrize(
    ("offset", "form", "name"),
    [
        (0, "B", "bumps_and_wheel_drops"),
        (10, "B", "infrared_omni"),
        (12, "h", "distance"),
        (16, "B", "charging"),
        (17, "H", "voltage"),
        (21, "b", "temperature"),
        (28, "H", "cliff_left_signal"),
        (40, "B", "mode"),
        (48, "h", "requested_right"),
        (50, "h", "requested_left"),
        (52, "h", "encoder_left"),
        (54, "h", "encoder_right"),
        (57, "H", "light_left"),
        (67, "H", "light_right"),
        (71, "h", "motor_left"),
        (79, "B", "stasis"),
    ],
)
def test_group_100_has_the_published_offsets(offset: int, form: str, name: str) -> None:
    data = bytes(range(80))
    (expected,) = struct.unpack_from(f">{form}", data, offset)
    assert packets.unpack(100, data)[name] == expected
    assert packets.pack(100, packets.unpack(100, data)) == data


def test_the_published_frame() -> None:
    published = bytes.fromhex("13 05 1D 02 19 0D 00 A3")
    values = {"cliff_front_left_signal": 0x0219, "virtual_wall": 0}
    assert frame((29, 13), values) == published
    assert Stream((29, 13)).feed(published) == [values]


def test_the_published_drive() -> None:
    made = interface(START, TO_SAFE, bytes([137, 255, 56, 1, 244]))
    made.look()
    read = sensed(made, 100)
    assert (read["requested_velocity"], read["requested_radius"]) == (-200, 500)
    assert made.body.right < made.body.left < 0  # backwards, in a curve to the left


def test_the_right_wheel_is_said_first() -> None:
    assert commands.drive_direct(-200, 500) == bytes([145, 255, 56, 1, 244])
    made = interface(START, TO_FULL, commands.drive_direct(-200, 500))
    assert (made.body.right, made.body.left) == (-200, 500)


# -- how it listens --------------------------------------------------------------


@settings(max_examples=40)
@given(st.lists(st.integers(1, 12), max_size=10))
def test_commands_come_in_any_portions(sizes: list[int]) -> None:
    said = START + TO_SAFE + commands.song(1, [(60, 32), (62, 16)])
    said += commands.drive_direct(100, -100) + bytes([Op.SENSORS, 35])
    made, answers = interface(), []
    for size in [*sizes, len(said)]:
        portion, said = said[:size], said[size:]
        answers += made.hear(portion)
    assert answers == [bytes([OFF])]  # the mode of its last look at its sensors
    assert (made.body.right, made.body.left) == (100, -100)
    assert made.songs == {1: 0.75}


@settings(max_examples=100)
@given(st.lists(st.binary(max_size=30), max_size=10))
def test_whatever_comes_is_survived(portions: list[bytes]) -> None:
    made = interface(START, TO_FULL)
    for portion in portions:
        made.hear(portion)
        on(made, TICK)
    assert abs(made.body.right) <= 500
    assert abs(made.body.left) <= 500
    made.hear(bytes(600) + START + TO_SAFE)  # no command waits for more than that
    assert made.mode == SAFE


def test_what_is_no_command_is_passed_over() -> None:
    made = interface(bytes(40), START, bytes([1, 2, 254]), TO_SAFE)
    assert made.mode == SAFE


def test_a_broken_command_waits_for_its_rest() -> None:
    made = interface(START, TO_SAFE, commands.drive_direct(100, 100)[:4])
    assert made.body.right == 0
    made.hear(commands.drive_direct(200, 200))
    assert (made.body.right, made.body.left) == (100, 145)  # the opcode is eaten


def test_modes() -> None:
    made = interface(TO_SAFE)
    assert made.mode == OFF
    assert made.hear(bytes([Op.SENSORS, 35])) == []
    for said, mode in [
        (START, PASSIVE),
        (commands.drive_direct(100, 100), PASSIVE),
        (TO_SAFE, SAFE),
        (TO_FULL, FULL),
        (commands.drive_direct(100, 100), FULL),
        (bytes([Op.CLEAN]), PASSIVE),
    ]:
        made.hear(said)
        assert made.mode == mode
        moves = said[0] == Op.DRIVE_DIRECT and mode >= SAFE
        assert bool(made.body.right) == moves
    made.hear(bytes([Op.STOP]))
    assert made.mode == OFF


@pytest.mark.parametrize(
    ("right", "left", "danger", "falls"),
    [
        (100, 100, "cliff", True),
        (-100, -100, "cliff", False),
        (-100, 100, "cliff", True),
        (-100, -90, "cliff", False),
        (0, 0, "cliff", False),
        (0, 0, "lifted", True),
        (-100, -100, "lifted", True),
        (0, 0, "charger", True),
    ],
)
def test_safe_mode_protects_it(right: int, left: int, danger: str, falls: bool) -> None:
    for mode, obeys in ((TO_SAFE, not falls), (TO_FULL, True)):
        made = interface(START, mode, commands.drive_direct(right, left))
        setattr(made.body, danger, True)
        on(made, TICK)
        assert (made.mode >= SAFE) == obeys
        assert (made.body.right, made.body.left) == ((right, left) if obeys else (0, 0))


def test_passive_mode_sleeps() -> None:
    made = interface(START)
    made.tick(299)
    assert made.mode == PASSIVE
    made.tick(2)
    assert made.mode == OFF


def test_it_is_set_to_another_speed() -> None:
    assert interface(START, bytes([Op.BAUD, 7])).baud == 19_200
    assert interface(START, bytes([Op.BAUD, 99])).baud == 115_200


# -- what it says ----------------------------------------------------------------


def test_sensors_are_looked_at_every_15_ms() -> None:
    made = interface(START)
    made.body.bumps = {"left"}
    assert sensed(made, 7)["bumps_and_wheel_drops"] == 0
    on(made, TICK)
    assert sensed(made, 7)["bumps_and_wheel_drops"] == 2


def test_distance_and_angle_count_from_the_last_reading() -> None:
    made = interface(START, TO_SAFE, commands.drive_direct(100, 100))
    on(made, 1.5)
    assert sensed(made, 19)["distance"] == pytest.approx(150, abs=1)
    assert sensed(made, 2)["distance"] == 0
    made.hear(commands.drive_direct(100, -100))
    on(made, 0.9)
    turned = 2 * 0.1 / 0.235 * 0.9 * 180 / pi
    assert sensed(made, 100)["angle"] == pytest.approx(turned, abs=1)
    assert sensed(made, 20)["angle"] == 0


def test_encoders_wrap() -> None:
    made = interface(START, TO_SAFE, commands.drive_direct(500, -500))
    on(made, 28.5)
    before = sensed(made, 101)
    assert before["encoder_right"] > 31_000
    on(made, 3.0)
    after = sensed(made, 101)
    assert after["encoder_right"] < -30_000
    assert after["encoder_left"] > 30_000


def test_speeds_are_limited() -> None:
    made = interface(START, TO_SAFE, commands.drive_direct(32_767, -32_768))
    assert (made.body.right, made.body.left) == (500, -500)


def test_a_query_and_a_pause() -> None:
    made = interface(START)
    on(made, TICK)
    assert made.hear(bytes([Op.QUERY, 2, 35, 36])) == [bytes([PASSIVE, 0])]
    made.hear(commands.stream([35, 26]))
    (said,) = on(made, TICK)
    assert Stream((35, 26)).feed(said) == [{"mode": PASSIVE, "capacity": 2696}]
    made.hear(bytes([Op.PAUSE, 0]))
    assert on(made, TICK) == []
    made.hear(bytes([Op.PAUSE, 1]))
    assert len(on(made, 3 * TICK)) == 3


def test_a_song_lasts_as_long_as_its_notes() -> None:
    made = interface(START, TO_SAFE, commands.song(2, [(72, 32)]), bytes([Op.PLAY, 2]))
    on(made, TICK)
    assert sensed(made, 100)["song_playing"] == 1
    on(made, 0.5)
    assert sensed(made, 100)["song_playing"] == 0


def test_it_starts_anew() -> None:
    device = Create2Device(boot=1.0)
    device.hear(START + TO_SAFE + commands.drive_direct(300, 300))
    for _ in range(20):
        device.live(TICK)
    assert device.interface.body.values()["encoder_left"] > 100
    assert device.hear(bytes([Op.RESET])) == [BANNER]
    assert device.hear(START) == []
    device.live(1.1)
    assert device.interface.mode == OFF
    device.hear(START)
    device.live(TICK)
    assert device.interface.mode == PASSIVE
    assert device.body.values()["encoder_left"] == 0
