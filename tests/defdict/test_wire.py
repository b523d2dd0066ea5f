"""The wire format: kept bytes, digests, and payloads that do not fit."""

import importlib
import os
import subprocess
import sys
from typing import Any

import pytest

from rems_net.defdict import Schema, angle, blob, length, number
from rems_net.defdict.values.classes import value_class
from tests.defdict.golden import CASES, FOLDER

msgpack: Any = importlib.import_module("msgpack")


def plain(value: Any) -> Any:
    """The same map as any other language would hold it."""
    return value.to_wire_map()


@pytest.mark.parametrize("name", CASES)
def test_golden_bytes(name: str) -> None:
    schema, values = CASES[name]
    value = schema(values)
    assert schema.digest.encode() == (FOLDER / f"{name}.digest").read_bytes()
    assert schema.to_wire() == (FOLDER / f"{name}.schema").read_bytes()
    payload = (FOLDER / f"{name}.payload").read_bytes()
    assert value.encode() == payload
    assert schema.decode(payload) == value


@pytest.mark.parametrize("name", CASES)
def test_payloads_are_ordinary_msgpack(name: str) -> None:
    schema, values = CASES[name]
    value = schema(values)
    assert value.encode() == msgpack.packb(plain(value))
    found = msgpack.unpackb(value.encode())
    assert list(found) == list(schema)


@pytest.mark.parametrize("name", CASES)
def test_a_schema_travels(name: str) -> None:
    schema, values = CASES[name]
    found = Schema.from_wire((FOLDER / f"{name}.schema").read_bytes())
    assert found == schema
    assert found.digest == schema.digest
    assert found.to_wire() == schema.to_wire()
    assert found() == schema()
    assert value_class(found) is value_class(schema)
    assert found.decode(schema(values).encode()) == schema(values)


def test_the_digest_is_of_what_values_mean() -> None:
    one = Schema("a", {"x": length("m", range=(0, 1)), "y": angle()})
    assert (
        one.digest == Schema("b", {"y": angle(), "x": length("m", range=(0, 1))}).digest
    )
    assert one.digest == one.rename(name="other").digest
    docs = Schema("a", {"x": length("m", range=(0, 1), doc="east"), "y": angle()})
    assert one.digest == docs.digest
    others = [
        {"x": length("mm", range=(0, 1)), "y": angle()},
        {"x": length("m", range=(0, 2)), "y": angle()},
        {"x": length("m", range=(0, 1), default=1), "y": angle()},
        {"x": length("m", range=(0, 1), max_age=1), "y": angle()},
        {"x": length("m", range=(0, 1)), "z": angle()},
        {"x": length("m", range=(0, 1))},
    ]
    digests = {Schema("a", entries).digest for entries in others} | {one.digest}
    assert len(digests) == len(others) + 1
    assert all(len(d) == 16 and int(d, 16) >= 0 for d in digests)


@pytest.mark.parametrize("default", [b"\0", b"a\0", b""])
def test_defaults_travel_to_the_last_byte(default: bytes) -> None:
    schema = Schema("s", {"x": blob(default=default), "y": number(default=-0.5)})
    assert Schema.from_wire(schema.to_wire())() == {"x": default, "y": -0.5}


def test_the_digest_is_the_same_in_another_process() -> None:
    code = "from tests.defdict.golden import CASES\n"
    code += "print(*(s.digest for s, _ in CASES.values()))"
    for seed in ("0", "1"):
        run = subprocess.run(
            [sys.executable, "-c", code],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        )
        assert run.stdout.split() == [s.digest for s, _ in CASES.values()]
