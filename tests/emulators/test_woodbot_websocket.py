"""The class's first firmware, emulated: what it does with each frame and quirk."""

import pytest

from rems_net.emulators.known import emulated
from rems_net.emulators.websocket import BINARY, GONE, OPEN, RESET, TEXT, Packet
from rems_net.emulators.woodbot_websocket import QUIRKS, OriginalWoodbot, turning
from rems_net.errors import ExperimentError

STAND = b"\x7e\x5a\x5a"
AHEAD = b"\x7e\x00\x00"


def robot(*quirks: str) -> OriginalWoodbot:
    """One with these quirks and no others."""
    return OriginalWoodbot(mended=set(QUIRKS) - set(quirks))


def ask(
    bot: OriginalWoodbot, kind: int, data: bytes = b"", client: int = 0
) -> list[tuple[int, bytes]]:
    """What it says, as pairs of kind and bytes; all of it to the same client."""
    said = [Packet.unpack(p) for p in bot.hear(Packet(client, kind, data).pack())]
    assert all(packet is not None and packet.client == client for packet in said)
    return [(packet.kind, packet.data) for packet in said if packet]


def test_greets_in_two_messages() -> None:
    said = ask(robot(), OPEN)
    assert said == [(OPEN, b""), (TEXT, b"Connected to "), (TEXT, b"My_Great_Woodbot")]


def test_a_command_is_echoed_up_to_its_first_zero_and_done_twice() -> None:
    bot = robot("echo")
    assert ask(bot, BINARY, AHEAD) == [(TEXT, b"~")]
    assert bot.driven == [(0, 0), (0, 0)]
    assert ask(bot, BINARY, STAND) == [(TEXT, b"~ZZ")]
    assert ask(bot, BINARY, b"\x7e\xb4\x5a") == [(TEXT, b"~\xb4Z")]  # no UTF-8
    bot = robot()
    assert ask(bot, BINARY, AHEAD) == []
    assert bot.driven == [(0, 0)]


def test_text_is_echoed_and_obeyed() -> None:
    bot = robot("zeros")
    assert ask(bot, TEXT, b"~ZZ") == [(TEXT, b"~ZZ")]
    assert bot.driven == [(90, 90)]
    assert ask(bot, TEXT, b"#17") == [(TEXT, b"#17")]
    assert ask(bot, TEXT, b"#F") == [(TEXT, b"#F")]
    assert ask(bot, TEXT, b"#S") == [(TEXT, b"#S"), (BINARY, bytes(5))]


def test_sensors_are_five_zeros() -> None:
    assert ask(robot("zeros"), BINARY, b"S") == [(BINARY, bytes(5))]
    said = ask(robot("zeros", "echo"), BINARY, b"S")
    assert said == [(BINARY, bytes(5)), (TEXT, b"S")]


def test_mended_they_are_numbers_cut_to_a_byte() -> None:
    bot = robot()
    bot.live(0.01)
    ((_, said),) = ask(bot, BINARY, b"S")
    # 0.4 m of wall less the lens, in mm; the compass shows north on the left.
    assert said == bytes([391 % 256, 398 % 256, 0, 750 % 256, 0])


def test_short_frames_take_what_was_in_memory() -> None:
    bot = robot("overread")
    ask(bot, BINARY, AHEAD)
    ask(bot, BINARY, b"\x7e")
    assert bot.driven[-1] == (0, 0), "full speed ahead"
    ask(bot, BINARY, b"\x7e\x5a")
    assert bot.driven[-1] == (90, 0)
    bot = robot()
    assert ask(bot, BINARY, b"\x7e") == []
    assert bot.driven == []


def test_nothing_stops_it_but_a_watchdog_of_its_own() -> None:
    for quirks, angles in (({"driving"}, (0, 0)), (set(), (90, 90))):
        bot = robot(*quirks)
        ask(bot, BINARY, AHEAD)
        for _ in range(60):
            bot.live(0.01)
        assert bot.driven[-1] == angles


def test_whoever_leaves_stops_it_for_all() -> None:
    for quirks, angles in (({"everybody"}, (90, 90)), (set(), (0, 0))):
        bot = robot(*quirks)
        ask(bot, OPEN, client=0)
        ask(bot, OPEN, client=1)
        ask(bot, BINARY, AHEAD, client=0)
        ask(bot, GONE, client=1)
        assert bot.driven[-1] == angles
        ask(bot, GONE, client=0)
        assert bot.driven[-1] == (90, 90)


def test_it_answers_nobody_while_it_starts() -> None:
    bot = robot("starting")
    assert ask(bot, OPEN), "it was switched on some time ago"
    bot.power(True)
    assert ask(bot, OPEN) == []
    assert bot.live(5.9) == []
    said = [Packet.unpack(p) for p in bot.live(0.2)]
    assert [p.kind for p in said if p] == [OPEN, TEXT, TEXT]


def test_without_power_it_forgets() -> None:
    bot = robot()
    ask(bot, BINARY, AHEAD)
    bot.power(False)
    assert not any(bot.wheels.values())
    assert [Packet.unpack(p) for p in bot.power(True)] == [Packet(0, RESET)]


@pytest.mark.parametrize(
    ("told", "share"),
    # ESP32Servo's pulses: 8.89 us a degree; 45 us of dead band, full from 450 us
    [(90, 0), (95, 0), (85, 0), (96, 0.02), (141, 1), (180, 1), (0, -1), (255, 1)],
)
def test_servos_stand_still_about_the_middle_and_saturate(
    told: int, share: float
) -> None:
    assert turning(told) == pytest.approx(share, abs=0.01)


def test_both_wheels_drive_ahead_below_90() -> None:
    bot = robot("driving")
    ask(bot, BINARY, b"\x7e\x00\x5a")
    assert bot.wheels == {"wheel/left": 0.0, "wheel/right": pytest.approx(7.3)}
    ask(bot, BINARY, b"\x7e\x5a\x00")
    assert bot.wheels == {"wheel/left": pytest.approx(7.3), "wheel/right": 0.0}
    ask(bot, BINARY, b"\x7e\xb4\xb4")
    for _ in range(100):
        bot.live(0.01)
    assert bot.state.x == pytest.approx(-7.3 * 0.02)


def test_damaged_packets_are_nothing() -> None:
    packet = Packet(1, TEXT, b"#17").pack()
    assert Packet.unpack(packet[:-1]) is None
    assert Packet.unpack(packet[:2]) is None
    assert robot().hear(packet[:-1]) == []


def test_bad_words() -> None:
    with pytest.raises(ExperimentError, match=r"no quirk .* Did you mean 'echo'\?"):
        OriginalWoodbot(mended=["ecko"])
    for port in ("here", "99999", "0.0.0.0:x"):
        with pytest.raises(ExperimentError, match="expected a port, such as 8181"):
            emulated("woodbot-ws", port)


def test_a_port_of_its_own() -> None:
    for a, b in (("0", "127.0.0.1:0"), ("", "")):
        with emulated("woodbot-ws", a) as one, emulated("woodbot-ws", b) as other:
            assert one.where != other.where
