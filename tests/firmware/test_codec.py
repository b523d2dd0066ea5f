"""The firmware's codec: compiled here, and held against Python's own."""

import random
import re
import struct
from pathlib import Path

import pytest

from rems_net.defdict import Schema
from rems_net.errors import WireError
from rems_net.robots.woodbot import Woodbot
from tests.commands import finished
from tests.defdict.fuzz import mutate
from tests.firmware.compiling import FIRMWARE
from tests.firmware.golden import BAD, FOLDER, VALUES, schemas, wheels
from tests.firmware.program import check_tables, compiled, run

TRIES = 4000


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The firmware's test of its codec."""
    return compiled(FIRMWARE, tmp_path_factory.mktemp("codec"))


# -- the golden files ---------------------------------------------------------


@pytest.mark.parametrize("name", VALUES)
def test_golden_bytes(name: str) -> None:
    schema = schemas()[name]
    value = schema(VALUES[name])
    payload = (FOLDER / f"{name}.payload").read_bytes()
    assert value.encode() == payload
    assert schema.decode(payload) == value
    assert schema.digest.encode() == (FOLDER / f"{name}.digest").read_bytes()
    assert schema.to_wire() == (FOLDER / f"{name}.schema").read_bytes()


@pytest.mark.parametrize("name", BAD)
def test_golden_refusals(name: str) -> None:
    payload, refusal, says = BAD[name]
    assert (FOLDER / f"{name}.bad").read_bytes() == payload
    assert (FOLDER / f"{name}.refusal").read_bytes() == refusal.encode()
    with pytest.raises(WireError, match=re.escape(says)):
        schemas()["command"].decode(payload)


def test_no_golden_file_is_forgotten() -> None:
    wanted = {f"{n}.{e}" for n in VALUES for e in ("schema", "digest", "payload")}
    wanted |= {f"{name}.{e}" for name in BAD for e in ("bad", "refusal")}
    assert {path.name for path in FOLDER.iterdir()} == wanted


def test_the_firmware_reads_the_golden_files(program: Path) -> None:
    lines = run(program, "golden", FOLDER, *BAD)
    assert len(lines) == 10 * len(VALUES) + len(BAD)
    assert all(line.startswith("ok ") for line in lines)


def test_the_firmware_notices_a_changed_file(program: Path, tmp_path: Path) -> None:
    for path in FOLDER.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "state.digest").write_bytes(b"0" * 16)
    (tmp_path / "nan.refusal").write_bytes(b"ok")
    done = finished([program, "golden", tmp_path, "nan"])
    assert done.returncode == 1
    failed = [line for line in done.stdout.splitlines() if line.startswith("FAIL")]
    assert failed == [
        "FAIL state: the digest",
        "FAIL nan: out_of_range wheel/left",
    ]


# -- the tables ---------------------------------------------------------------


def test_the_tables_are_those_of_woodbot(program: Path) -> None:
    check_tables(run(program, "table"), Woodbot)


# -- against Python -----------------------------------------------------------


def expected(schema: Schema, payload: bytes) -> str:
    """Return what the firmware should print of a payload, "refused" if anything."""
    try:
        value = schema.decode(payload)
    except WireError:
        return "refused"
    numbers = struct.pack(f">{len(schema.fields)}d", *value.to_array())
    return f"{numbers.hex()} {value.encode().hex()}"


def printed(schema: Schema, line: str) -> str:
    """Return what the firmware printed, in the same form."""
    words = line.split()
    if words[0] != "ok":
        return "refused"
    *values, payload = words[1:]
    numbers = struct.pack(f">{len(schema.fields)}d", *map(float.fromhex, values))
    return f"{numbers.hex()} {payload}"


NUMBERS = [
    *(b"\x00", b"\x07", b"\x08", b"\x7f", b"\xe0", b"\xf8", b"\xf9", b"\xff"),
    *(b"\xcc\x07", b"\xcd\x00\x07", b"\xce\0\0\0\x08", b"\xcf" + bytes(7) + b"\x05"),
    *(b"\xcf" + b"\xff" * 8, b"\xcf\x80" + bytes(6) + b"\x01", b"\xd3\x80" + bytes(7)),
    *(b"\xd0\xf9", b"\xd0\x80", b"\xd1\xff\xf9", b"\xd2\xff\xff\xff\xfa"),
    *(b"\xd3" + b"\xff" * 8, b"\xd3" + bytes(7) + b"\x03", b"\xc0", b"\xc2", b"\xc3"),
    *(b"\xa1\x31", b"\xc4\x01\x31", b"\x90", b"\x80", b"\xc1", b"\xd4\x01\x01"),
    *(b"\xca" + struct.pack(">f", x) for x in (7.3, 7.25, -0.0, 1e-45, 3e38)),
    *(b"\xca" + struct.pack(">f", float(x)) for x in ("nan", "inf", "-inf")),
    *(b"\xcb" + struct.pack(">d", x) for x in (7.3, -7.3, 7.300000000000001, 5e-324)),
    *(b"\xcb" + struct.pack(">d", x) for x in (-0.0, 1.7976931348623157e308)),
    *(b"\xcb" + struct.pack(">d", float(x)) for x in ("nan", "inf", "-inf")),
]


def written(rng: random.Random, schema: Schema, odd: float) -> bytes:
    """Return a payload of a schema as another encoder may write it."""
    entries = list(schema.entries.items())
    if rng.random() < 0.3:
        rng.shuffle(entries)
    if rng.random() < odd:
        entries.insert(rng.randrange(len(entries) + 1), rng.choice(entries))
    if rng.random() < odd:
        del entries[rng.randrange(len(entries))]
    made = map_head(rng, len(entries))
    for key, entry in entries:
        made += text(rng, key if rng.random() >= odd else rng.choice(["x", "", "lef"]))
        if isinstance(entry, Schema):
            made += written(rng, entry, odd)
        elif rng.random() < 0.5:
            made += rng.choice(NUMBERS)
        else:
            made += b"\xcb" + struct.pack(">d", rng.uniform(-7.3, 7.3))
    return made


def map_head(rng: random.Random, count: int) -> bytes:
    heads = (b"\xde", ">H"), (b"\xdf", ">I")
    head, form = rng.choice(heads)
    short = rng.random() < 0.8
    return bytes([0x80 | count]) if short else head + struct.pack(form, count)


def text(rng: random.Random, key: str) -> bytes:
    data = key.encode()
    head, form = rng.choice(((b"\xd9", ">B"), (b"\xda", ">H"), (b"\xdb", ">I")))
    short = rng.random() < 0.8
    size = bytes([0xA0 | len(data)]) if short else head + struct.pack(form, len(data))
    return size + data


@pytest.mark.parametrize("name", VALUES)
def test_the_firmware_takes_what_python_takes(
    program: Path, tmp_path: Path, name: str
) -> None:
    schema = schemas()[name]
    rng = random.Random(f"{name} 1")
    seeds = [schema(VALUES[name]).encode(), written(rng, schema, 0.0)]
    tries = [one for one, _, _ in BAD.values()] + [wheels(7, -7)]
    tries += [mutate(rng, seeds) for _ in range(TRIES // 2)]
    tries += [written(rng, schema, 0.03) for _ in range(TRIES // 2)]
    path = tmp_path / "tries"
    path.write_bytes(b"".join(struct.pack("<H", len(one)) + one for one in tries))
    lines = run(program, "try", name, path)
    assert len(lines) == len(tries)
    taken = 0
    for payload, line in zip(tries, lines, strict=True):
        wanted = expected(schema, payload)
        assert printed(schema, line) == wanted, f"{payload.hex()}: {line}"
        taken += wanted != "refused"
    assert TRIES // 20 < taken < TRIES  # both kinds came
    statuses = {line.split()[0] for line in lines}
    assert len(statuses) == 11, statuses  # all but no_room
