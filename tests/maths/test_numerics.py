"""Recordings do not tell which processor they were made with."""

import hashlib
import json
import os
import platform
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from rems_net.maths import numerics
from rems_net.maths.numerics import Platforms, describe, environment
from tests.commands import ROOT
from tests.maths.steps import digests

PROGRAM = Path(__file__).with_name("platforms.py")
#: environments that hide what a processor has, from glibc, from numpy and OpenBLAS
OLD = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX2_Usable,-FMA_Usable"}
OLDER = {
    "GLIBC_TUNABLES": "glibc.malloc.check=0:glibc.cpu.hwcaps=-AVX,-AVX2,-FMA",
    "NPY_DISABLE_CPU_FEATURES": ",".join(numerics._simd("found")),
    "OPENBLAS_CORETYPE": "Prescott",
}
pinned_here = pytest.mark.skipif(
    not numerics._can_be_pinned(),
    reason=f"only glibc on x86-64 can be told what to use; this is {describe()}",
)


def cpu_has_fma() -> bool:
    flags = Path("/proc/cpuinfo").read_text(encoding="utf-8").partition("flags")[2]
    return "fma" in flags.partition("\n")[0].split()


def record(out: Path, *words: str, **hidden: str) -> dict[str, str]:
    """Digest of each file of a run in a process of its own."""
    clean = {k: v for k, v in os.environ.items() if k not in OLDER}
    done = subprocess.run(
        [sys.executable, str(PROGRAM), str(out), *words],
        env={**clean, "PYTHONPATH": str(ROOT), **hidden},
        capture_output=True,
        text=True,
        timeout=110,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    made = sorted(out.iterdir())
    return {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in made}


@pinned_here
def test_a_run_is_the_same_whatever_the_processor_has(tmp_path: Path) -> None:
    here = record(tmp_path / "here")
    assert {"k0.csv", "led.csv", "run.json"} < here.keys()
    assert record(tmp_path / "old", **OLD) == here
    assert record(tmp_path / "older", **OLDER) == here
    line = json.loads((tmp_path / "old/run.json").read_text())["numerics"]
    assert ", pinned" in line
    assert ("mujoco" in line) == ("mujoco.csv" in here)


@pinned_here
def test_natively_only_the_kinematic_robots_are_the_same(tmp_path: Path) -> None:
    if not cpu_has_fma():
        pytest.skip("this processor does not fuse, so there is nothing to hide")
    here = record(tmp_path / "here", "--native")
    old = record(tmp_path / "old", "--native", **OLDER)
    same = {name for name in here if old[name] == here[name]}
    assert same == {"k0.csv", "k1.csv", "k2.csv"}
    line = json.loads((tmp_path / "old/run.json").read_text())["numerics"]
    assert "native" in line
    assert "-FMA" in line


def test_the_bits_are_these_on_every_system() -> None:
    """Made on Linux x86-64: who gets others has found a mistake."""
    assert digests() == {
        "functions": "65e63ead732a",
        "alone euler": "d692ccdc924a",
        "alone rk4": "7e736ad4b000",
        "together euler": "a9c3ae6a1983",
        "together rk4": "2dbf217214e8",
    }


def test_another_architecture_computes_the_same() -> None:
    other = shlex.split(os.environ.get("REMS_OTHER_PYTHON", ""))
    if not other:
        pytest.skip(
            "no Python of another architecture: REMS_OTHER_PYTHON does not name one, "
            "and `python -m tests.maths.emulate FOLDER` gets one on Debian"
        )
    done = subprocess.run(
        [*other, "-m", "tests.maths.steps"],
        env={"PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        timeout=110,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert platform.machine() not in done.stderr
    assert json.loads(done.stdout) == digests()


@pinned_here
def test_what_a_process_is_told_keeps_what_others_said() -> None:
    outer = {
        "HOME": "/home/ann",
        "GLIBC_TUNABLES": "glibc.malloc.check=0:glibc.cpu.hwcaps=-AVX,-FMA",
        "NPY_ENABLE_CPU_FEATURES": "X",
        "OMP_NUM_THREADS": "2",
    }
    made = environment(outer)
    assert made["HOME"] == "/home/ann"
    hidden = "-FMA,-FMA4,-FMA_Usable,-FMA4_Usable,-AVX"
    assert made["GLIBC_TUNABLES"] == f"glibc.malloc.check=0:glibc.cpu.hwcaps={hidden}"
    assert "NPY_ENABLE_CPU_FEATURES" not in made
    assert (made["OMP_NUM_THREADS"], made["MKL_NUM_THREADS"]) == ("2", "1")
    assert environment(made) == made
    assert describe(made).endswith(", pinned")
    assert "native" in describe(outer)
    assert environment(outer, native=True) == {
        **outer,
        "OPENBLAS_NUM_THREADS": "1",
        "MKL_NUM_THREADS": "1",
    }


def test_who_computes_differently_is_named_once() -> None:
    platforms = Platforms()
    assert platforms.news("robot/old on desk", "") == ""
    assert platforms.news("robot/a on desk", "Linux") == ""
    assert platforms.news("robot/b on desk", "Linux") == ""
    assert platforms.news("robot/c on mac", "macOS") == (
        "robot/c on mac computes on macOS, and robot/a on desk on Linux: what they "
        "record may differ in its last digits from a run on one of them alone."
    )
    assert platforms.news("robot/d on mac", "macOS") == ""
