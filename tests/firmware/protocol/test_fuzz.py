"""The whole core, fuzzed from the network, with sanitizers: a short run of it.

A long one: `pytest tests/firmware/protocol/test_fuzz.py` with RUNS raised, or by hand,
as firmware/esp32_woodbot/test/fuzz_woodbot.c says.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from rems_net.agents.protocol.messages import Loan, pack_age, pack_beat
from rems_net.agents.tick import Tick, time_of
from rems_net.router.message import pack, pack_stamp
from tests.firmware.compiling import CORE, FIRMWARE, compiler
from tests.firmware.golden import schemas

RUNS = 3_000
RUN = 0x12_3456_789A
FUZZ = ["-std=c11", "-g", "-O1", "-fsanitize=fuzzer,address,undefined"]
FUZZ += ["-fno-sanitize-recover=all"]

HEAR, ASKED, ANSWERED, OTHERS, TICK, ROUND = range(6)
LOOKS = 0  # which of `OTHERS`: the clock that it shall be lent to


def message(kind: int, key: int, content: bytes = b"") -> bytes:
    return bytes([kind, key, len(content)]) + content


def command(n: int, key: int = 2) -> bytes:
    """Stamped; the first byte is the size of the stamp, and chooses the encoding."""
    payload = schemas()["command"]({"wheel": {"left": 3.0, "right": 2.0}}).encode()
    stamp = pack_stamp(n, n * 0.02, RUN << 24 | 9)
    return message(HEAR, key, bytes([len(stamp)]) + stamp + payload)


def driven() -> bytes:
    ages = message(ANSWERED, 0, pack_age(RUN, 0.001, 0))
    return (message(TICK, 1) + message(ROUND, 0) + ages + command(2)) * 8


def lent() -> bytes:
    there = pack({"n": 5, "t": 0.1, "dt": 0.02, "pace": 1.0, "epoch": 0, "stops": 0})
    loan = Loan("b", {"command": "input/keys"}).to_wire()
    away = message(ASKED, 0, loan) + message(ROUND, 0)
    away += message(OTHERS, LOOKS, there) + message(ROUND, 1) * 3
    for n in range(1, 9):
        beat = pack_beat(RUN, Tick(n, time_of(n, 0.02), 0.02, 1.0, 1), 0)
        away += message(HEAR, 3, b"\0" + beat) + message(TICK, 1) + message(ROUND, 0)
        age = pack_age(RUN, 0.001, 0)
        away += b"".join(message(ANSWERED, back, age) for back in range(8))
        away += command(n, key=7) + message(ROUND, 0)
    back = message(ASKED, 0, Loan("", {}).to_wire()) + message(ROUND, 0)
    return driven() + away + back + driven()


def seeds() -> list[bytes]:
    stop = message(HEAR, 1, b"\0\xc3") + message(ROUND, 0)
    asked = b"".join(message(ASKED, key) for key in range(32))
    servos = {"args": [], "kwargs": {"left_trim": 10.0}}
    call = message(ASKED, 5, pack(servos)) + message(ROUND, 0)
    return [driven() + stop + driven(), lent(), asked + call, driven() + asked]


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("fuzz") / "fuzz_woodbot"
    sources = [FIRMWARE / "test" / "fuzz_woodbot.c", *sorted(CORE.rglob("*.c"))]
    words = [compiler("clang"), *FUZZ, *map(str, sources), "-lm", "-o", str(made)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode != 0 and "libclang_rt" in done.stderr:
        pytest.skip("This clang has no libFuzzer, or no sanitizers.")
    assert done.returncode == 0, done.stderr
    return made


def test_nothing_that_comes_does_harm(program: Path, tmp_path: Path) -> None:
    folder = tmp_path / "corpus"
    folder.mkdir()
    for i, seed in enumerate(seeds()):
        (folder / str(i)).write_bytes(seed)
    words = [f"-runs={RUNS}", "-seed=1", "-max_len=2000", "-print_final_stats=1"]
    done = subprocess.run(
        [str(program), *words, str(folder)],
        capture_output=True,
        text=True,
        errors="replace",
        cwd=tmp_path,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-4000:]
    assert f"stat::number_of_executed_units: {RUNS}" in done.stderr


def test_its_seeds_get_about(program: Path, tmp_path: Path) -> None:
    """Each gets where it is to: driven, stopped, lent; the program says so."""
    said = []
    for i, seed in enumerate(seeds()):
        path = tmp_path / f"{i}"
        path.write_bytes(seed)
        done = subprocess.run(
            [str(program), str(path)],
            capture_output=True,
            text=True,
            errors="replace",
            env={"FUZZ_TELL": "1"},
            cwd=tmp_path,
            check=False,
        )
        assert done.returncode == 0, done.stderr[-4000:]
        said.append({line for line in done.stdout.splitlines() if line})
    assert {"driven", "stopped"} <= said[0]
    assert {"driven", "lent", "driven abroad"} <= said[1]
    assert "driven" in said[3]
