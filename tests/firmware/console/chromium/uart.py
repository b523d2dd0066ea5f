"""What a serial line's receiver makes of bytes that were sent at another speed."""

from collections.abc import Iterator

#: bits of a byte on the line: a start bit (0), eight data bits, a stop bit (1)
BITS = 10


def received(content: bytes, sent: int, read: int) -> Iterator[int | str]:
    """Yield bytes, and the names of Web Serial's errors, in their order.

    sent, read: bits per second of both ends. The line rests at 1 before and after.
    A receiver waits for a falling edge, and then looks at the middle of each bit. It
    looks for the edge sixteen times a bit, as UARTs do.
    """
    step = 1 / (16 * max(sent, read))
    line = [1]
    for byte in content:
        line += [0, *(byte >> i & 1 for i in range(8)), 1]

    def level(at: float) -> int:
        return line[int(at * sent)] if int(at * sent) < len(line) else 1

    at, end = 0.0, len(line) / sent
    while at < end:
        if level(at) == 1:
            at += step
            continue
        bits = [level(at + (i + 0.5) / read) for i in range(BITS)]
        if bits[0] == 1:  # too short for a start bit
            at += 0.5 / read
            continue
        if bits[-1] == 1:
            yield sum(bit << i for i, bit in enumerate(bits[1:-1]))
        else:
            yield "BreakError" if not any(bits) else "FramingError"
        at += (BITS - 0.5) / read
        while at < end and bits[-1] == 0 and level(at) == 0:
            at += step  # the line has to come back to rest first
