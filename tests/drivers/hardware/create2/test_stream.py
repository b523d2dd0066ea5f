"""Frames of a Create 2, found in whatever comes; a damaged one never passes."""

from hypothesis import example, given, settings, strategies as st

from rems_net.drivers.hardware.create2 import packets, readings
from rems_net.drivers.hardware.create2.stream import HEADER, Stream, frame

NUMBERS = readings.numbers()
LIMITS = {"B": (0, 255), "b": (-128, 127), "H": (0, 65_535), "h": (-32_768, 32_767)}
VALUES = st.fixed_dictionaries(
    {
        packets.PACKETS[number][0]: st.integers(*LIMITS[packets.PACKETS[number][1]])
        for number in NUMBERS
    }
)
ZEROS = dict.fromkeys((packets.PACKETS[number][0] for number in NUMBERS), 0)
#: whose check is what the next frame begins with
ALIKE = ZEROS | {"wall": (frame(NUMBERS, ZEROS)[-1] - HEADER) % 256}
LAST = Stream(NUMBERS).size - 1
laws = settings(max_examples=50)


@laws
@given(st.lists(VALUES, min_size=1, max_size=3), st.data())
def test_frames_in_any_portions(
    values: list[dict[str, int]], data: st.DataObject
) -> None:
    said = b"".join(frame(NUMBERS, one) for one in values)
    stream, found = Stream(NUMBERS), []
    while said:
        size = data.draw(st.integers(1, len(said)))
        portion, said = said[:size], said[size:]
        found += stream.feed(portion)
    assert found == values
    assert stream.damaged == 0


@laws
@given(st.binary(max_size=300), VALUES)
def test_a_frame_behind_whatever_was_said(
    before: bytes, values: dict[str, int]
) -> None:
    stream = Stream(NUMBERS)
    assert stream.feed(before) == []
    # What came before may end as a frame begins; the next is found in any case.
    assert stream.feed(2 * frame(NUMBERS, values))[-1] == values


@laws
@given(VALUES, st.integers(0, LAST), st.integers(0, 7))
@example(ALIKE, LAST, 0)
def test_a_wrong_bit_or_a_lost_byte_is_found(
    values: dict[str, int], at: int, bit: int
) -> None:
    whole = frame(NUMBERS, values)
    wrong = whole[:at] + bytes([whole[at] ^ 1 << bit]) + whole[at + 1 :]
    for damaged in (wrong, whole[:at] + whole[at + 1 :]):
        stream = Stream(NUMBERS)
        found = stream.feed(whole + damaged + 2 * whole)
        assert found == 3 * [values]
        assert stream.damaged == 1


def test_it_fits_in_15_ms() -> None:
    """172 bytes do, at 115200 bits per second."""
    assert Stream(NUMBERS).size <= 172
