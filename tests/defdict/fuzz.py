"""A fuzzer for the decoders: random bytes, and good payloads that were damaged.

    python -m tests.defdict.fuzz 10_000_000 [seed]

Whatever comes, a decoder returns a value that encodes again, or raises WireError,
within a bound of time and memory. Anything else ends the run and prints the input.
"""

import random
import sys
import time
import tracemalloc
from collections.abc import Callable
from typing import Any

from rems_net.defdict import DefDict, Schema, number
from rems_net.defdict.units.unit import find_unit
from rems_net.errors import ConversionError, FieldValueError, UnitError, WireError
from tests.defdict.golden import CASES

# One decode of a payload of at most 4 KiB: no longer, and no more memory, than this.
SECONDS, MEMORY = 1.0, 40 << 20

Decoder = Callable[[bytes], Any]
HEADS = bytes([0x80, 0x8F, 0x90, 0x9F, 0xA0, 0xBF, *range(0xC0, 0xE0), 0xFF])


def mutate(rng: random.Random, seeds: list[bytes]) -> bytes:
    """Return noise, or a damaged copy of one of the seeds."""
    kind = rng.randrange(8)
    if kind == 0:
        return rng.randbytes(rng.randrange(48))
    if kind == 1:
        return bytes(rng.choices(HEADS, k=rng.randrange(1, 48)))
    data = bytearray(rng.choice(seeds))
    for _ in range(rng.choice((1, 1, 1, 2, 4, 16))):
        at = rng.randrange(len(data) + 1)
        what = rng.randrange(6)
        if what == 0 and at < len(data):
            data[at] ^= 1 << rng.randrange(8)
        elif what == 1 and at < len(data):
            data[at] = rng.choice(HEADS)
        elif what == 2:
            del data[at : at + rng.randrange(1, 9)]
        elif what == 3:
            data[at:at] = rng.randbytes(rng.randrange(1, 9))
        elif what == 4:
            data[at:at] = rng.choice(seeds)[: rng.randrange(1, 64)]
        else:
            data[at : at + 8] = rng.choice(SPECIAL)
    return bytes(data[:4096])


SPECIAL = [
    b"\x7f\xf8\0\0\0\0\0\0",  # NaN
    b"\x7f\xf0\0\0\0\0\0\0",  # infinity
    b"\xdd\xff\xff\xff\xff",  # a list of four thousand million
    b"\xdf\xff\xff\xff\xff",
    b"\xc6\xff\xff\xff\xff",
    b"\xdb\xff\xff\xff\xff",
    b"\x91" * 8,
    b"\x81\xa0" * 4,
    b"\xc7\xff\xff",
    b"\xd6\xff\xff\xff\xff\xff",
]


# What a unit is made of; chained, it must never be evaluated.
PIECES = ["m", "m", "s", "km", "ns", "rad", "%", "N*m", "mile", "degC", "m^2", "1", "9"]
PIECES += [
    "99",
    ".",
    "-",
    "(",
    ")",
    " ",
    "^",
    "**",
    "**",
    "**",
    "*",
    "*",
    "*",
    "/",
    "/",
]
PIECES += ["**9", "**2", "**-1", "**(1/2)", "km**8*", "ns**8/", "9**9"]


def chain(rng: random.Random) -> bytes:
    """Return a text that looks like a unit, or like an expression that takes ages."""
    made = "".join(rng.choices(PIECES, k=rng.choice((1, 2, 3, 4, 6, 12, 40))))
    return (made * rng.choice((1, 1, 1, 2, 9))).encode()[:4096]


def unit(data: bytes) -> DefDict:
    """Use a text as the unit of a field, and convert from it, as a reader would."""
    text = data.decode()
    try:
        schema = Schema("s", {"x": number(text)})
    except UnitError as why:
        raise WireError(str(why)) from why
    found = Schema.from_wire(schema.to_wire())
    for other in ("m", "s**2", text):
        try:
            assert (
                found.converter(Schema("t", {"x": number(other)}))(found()) is not None
            )
        except ConversionError:
            continue
        except FieldValueError:
            continue  # beyond any float
    return found()


def targets() -> list[tuple[str, Decoder, list[bytes]]]:
    """Return name, decoder and good payloads of everything that reads bytes."""
    made: list[tuple[str, Decoder, list[bytes]]] = []
    for name, (schema, values) in CASES.items():
        good = [schema(values).encode(), schema().encode()]
        made.append((name, schema.decode, good))
    source, values = CASES["woodbot_command"]
    left_only = source.slice("wheel/left")
    good = [source(values).encode()]
    made.append(("converter", source.converter(left_only).decode, good))
    wires = [schema.to_wire() for schema, _ in CASES.values()]
    made.append(("from_wire", Schema.from_wire, wires))
    find_unit("mile")  # imports unyt, whose memory is its own
    made.append(("units", unit, []))
    return made


def check(decode: Decoder, data: bytes) -> bool:
    """Decode; return whether it was good. Raises AssertionError on a broken promise."""
    try:
        found = decode(data)
    except WireError:
        return False
    except FieldValueError:
        # Only a converter may find that a good payload does not fit its target.
        assert decode.__name__ == "decode"
        assert type(getattr(decode, "__self__", None)).__name__ == "Converter"
        return False
    if isinstance(found, Schema):
        assert Schema.from_wire(found.to_wire()) == found
    else:
        again = found.encode()
        assert found.schema.decode(again).encode() == again
    return True


def run(count: int, seed: int = 0, *, memory: bool = False) -> dict[str, int]:
    """Try `count` inputs; return how many of each target were accepted."""
    rng = random.Random(seed)
    every = targets()
    good = dict.fromkeys((name for name, _, _ in every), 0)
    weights = [1 if name in ("from_wire", "units") else 12 for name, _, _ in every]
    picks = rng.choices(every, weights, k=1024)
    for i in range(count):
        name, decode, seeds = picks[i & 1023]
        data = mutate(rng, seeds) if seeds else chain(rng)
        if memory:
            tracemalloc.start()
        start = time.process_time()
        try:
            good[name] += check(decode, data)
        except BaseException:
            print(f"{name}: seed {seed}, input {i}: {data!r}", file=sys.stderr)
            raise
        spent = time.process_time() - start
        assert spent < SECONDS, f"{name} took {spent:.1f} s for {data!r}"
        if memory:
            _, peak = tracemalloc.get_traced_memory()
            tracemalloc.stop()
            assert peak < MEMORY, f"{name} took {peak} bytes for {data!r}"
    return good


if __name__ == "__main__":
    total = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    began = time.perf_counter()
    accepted = run(total, int(sys.argv[2]) if len(sys.argv) > 2 else 0)
    took = time.perf_counter() - began
    print(f"{total} inputs in {took:.0f} s; accepted: {accepted}")
