"""The core, fuzzed for a moment: a long run is a command of one line (fuzz/*.c)."""

import os
import re
import subprocess
from collections.abc import Iterable
from pathlib import Path

import pytest

from tests.firmware.compiling import CORE, FIRMWARE, STRICT, build, compiler
from tests.firmware.golden import FOLDER

FLAGS = ["-g", "-O1", "-fsanitize=fuzzer,address,undefined"]
FATAL = ["-fno-sanitize-recover=all"]
HERE = FIRMWARE / "test" / "fuzz"
RUNS = 5000


def fuzzer(folder: Path, sources: Iterable[Path]) -> Path:
    """A program of libFuzzer's; skips where there is none."""
    words = [compiler("clang"), *STRICT, *FLAGS, *FATAL, f"-I{CORE}"]
    empty = folder / "empty.c"
    empty.write_text(
        "#include <stdint.h>\n#include <stddef.h>\n"
        "int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);\n"
        "int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)\n"
        "{ return data == NULL && size > 0; }\n",
        encoding="utf-8",
    )
    tried = [*words, str(empty), "-o", str(folder / "empty")]
    done = subprocess.run(tried, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        pytest.skip(f"This clang has no libFuzzer: {done.stderr.strip()[-200:]}")
    return build([*words, *map(str, sources), "-lm"], folder / "fuzz")


def run(program: Path, *words: str | Path, tells: bool = False) -> str:
    """What it prints; a law that is broken fails the test, with the input in hex."""
    environment = os.environ | ({"FUZZ_TELLS": "1"} if tells else {})
    done = subprocess.run(
        [program, f"-artifact_prefix={program.parent}/", *words],
        capture_output=True,
        text=True,
        errors="replace",
        env=environment,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-5000:]
    return done.stdout + done.stderr


def fuzz(program: Path, seeds: dict[str, bytes], longest: int) -> None:
    corpus = program.parent / "corpus"
    corpus.mkdir()
    for name, seed in seeds.items():
        (corpus / name).write_bytes(seed)
    told = run(program, f"-runs={RUNS}", f"-max_len={longest}", "-seed=1", corpus)
    assert re.search(rf"Done {RUNS} runs", told)


def test_codec(tmp_path: Path) -> None:
    sources = [CORE / "codec.c", CORE / "woodbot_schemas.c", HERE / "codec.c"]
    ports = ("command", "state", "sensors")
    seeds = {
        port: bytes([i, 255]) + (FOLDER / f"{port}.payload").read_bytes()
        for i, port in enumerate(ports)
    }
    fuzz(fuzzer(tmp_path, sources), seeds, 200)


# -- the whole core: inputs that are words of fuzz/woodbot.c ---------------------


def rounds(*messages: bytes, pause: int = 100) -> bytes:
    """Once round the link's loop, after so many tenths of a ms; these come in it."""
    return bytes([6, pause, len(messages)]) + b"".join(messages)


def wait(root: int) -> bytes:
    """Let 20 us times the square of this go by."""
    return bytes([3, root])


def answer(question: int) -> bytes:
    """The clock answers a question, by its number: how old a tick is, 0 s."""
    return bytes([2, 128 + question, 0])


TICK = bytes([0, 0, 0])
ADMISSION = ANSWER = bytes([2, 1, 0])  # the newest question
COMMAND = bytes([4, 0x11, 200, 200, 0, 0])
AHEAD = bytes([4, 0x11, 200, 200, 5, 0])
STOP = bytes([6, 8])
#: somebody asks for the lease, and commands with its badge
CLAIM, LED = bytes([5, 68, 2, 0]), bytes([4, 0x11, 200, 200, 22, 0])
STOPS_AND_RELEASE = bytes([2, 0]) * 2
#: switched on, declared, let in; a command's age is not known before it hears that
IN = bytes([6, 100]) + rounds() * 3 + rounds(ADMISSION) + rounds(TICK)
KNOWN = IN + rounds(answer(1)) + rounds(TICK) * 20 + rounds(answer(3))
DRIVEN = KNOWN + rounds(TICK, COMMAND) + rounds(TICK) + wait(100)
STOPPED = DRIVEN + rounds(TICK, COMMAND) + rounds(STOP, TICK, COMMAND) + wait(60)
LATER = b"".join(rounds(answer(i)) for i in range(4, 11))
RELEASED = STOPPED + STOPS_AND_RELEASE + rounds(TICK) * 40 + rounds(TICK, COMMAND)
LEASED = KNOWN + rounds(CLAIM) + rounds(TICK) * 20 + LATER
SEEDS = {
    "in": IN,
    "driven": DRIVEN,
    "stopped": STOPPED,
    "released": RELEASED + LATER + rounds(TICK, COMMAND) + wait(60),
    "ahead": KNOWN + rounds(TICK, AHEAD) + (wait(70) + rounds(TICK, ANSWER)) * 9,
    "led": LEASED + rounds(TICK, LED) + rounds(TICK, COMMAND) + wait(100),
    "unled": LEASED + wait(230) + rounds(TICK, LED) + wait(60),
    "tested": IN + bytes([0, 0, 0]) + (wait(200) + rounds()) * 3,
}


@pytest.mark.timeout(600)  # of a machine that does other things, too
def test_the_whole_core(tmp_path: Path) -> None:
    """The laws: see `servo` of fuzz/world.c. Seeds reach what chance seldom does."""
    names = ("link.c", "messages.c", "woodbot.c", "world.c")
    sources = [*sorted(CORE.rglob("*.c")), *(HERE / name for name in names)]
    program = fuzzer(tmp_path, sources)
    driven, led = {}, set()
    for name, seed in SEEDS.items():
        (tmp_path / name).write_bytes(seed)
        told = run(program, tmp_path / name, tells=True)
        led |= {name} if ", led" in told else set()
        driven[name] = int(re.findall(r"driven for (\d+) steps", told)[-1])
    assert driven["in"] == 0
    assert 0 < driven["driven"] <= 51, "until the command is 0.5 s old"
    assert 0 < driven["stopped"] < driven["released"]
    assert driven["ahead"] <= 51
    assert driven["tested"] > 0
    assert led == {"led"}
    fuzz(program, SEEDS, 400)
