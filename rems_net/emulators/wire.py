"""Wire: what a receiver makes of bytes that were sent at another speed than its own."""

#: of a byte on the line: a low start bit, eight bits with the lowest first, a high stop
BITS = 10


def resampled(portion: bytes, sent: int, heard: int) -> bytes:
    """Return what a receiver at `heard` bits per second takes bytes sent at `sent` for.

    It waits for the line to fall, then looks at it in the middle of each of its own
    bits. Between two portions the line is high.
    """
    levels: list[int] = []
    for byte in portion:
        levels += [0, *(byte >> bit & 1 for bit in range(8)), 1]
    step = sent / heard  # of its bits, in those of the sender
    found = bytearray()
    at = _falls(levels, 0)
    while at >= 0:
        middles = (at + (1.5 + bit) * step for bit in range(8))
        looks = [levels[m] if m < len(levels) else 1 for m in map(int, middles)]
        found.append(sum(level << bit for bit, level in enumerate(looks)))
        at = _falls(levels, max(at + 1, int(at + (BITS - 0.5) * step)))
    return bytes(found)


def _falls(levels: list[int], begin: int) -> int:
    """Where the line falls next, from high to low; -1 for never again."""
    for at in range(begin, len(levels)):
        if not levels[at] and (at == 0 or levels[at - 1]):
            return at
    return -1
