"""Numerics: the instructions a process computes with, and how all hosts get the same.

The C library, numpy and OpenBLAS each choose their code by the processor they find. A
processor that multiplies and adds in one step rounds once; others round twice. So the
last digits of a recording would depend on the laptop. On Linux with glibc on x86-64 the
environment of a new process can limit each of the three to what every such processor
can do.
"""

import os
import platform
import sys
from collections.abc import Mapping
from typing import Any

import numpy as np

TUNABLES, HWCAPS = "GLIBC_TUNABLES", "glibc.cpu.hwcaps"
#: Processor features that glibc must not use; before 2.33 their name has `_Usable`, and
#: unknown names are ignored. Without them, no variant of sin, exp, pow, ... fuses.
FUSED = ("-FMA", "-FMA4", "-FMA_Usable", "-FMA4_Usable")
DISABLE, ENABLE = "NPY_DISABLE_CPU_FEATURES", "NPY_ENABLE_CPU_FEATURES"
#: OpenBLAS's kernels for processors since 2008: numpy's wheels ask for them, too
BLAS, KERNELS = "OPENBLAS_CORETYPE", "Nehalem"
#: Numbers of threads of linear algebra: one by default. Sums by several threads depend
#: on their number, so a recording would depend on the number of cores; and starting
#: them takes half of a process's start.
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


def environment(outer: Mapping[str, str], *, native: bool = False) -> dict[str, str]:
    """Return the environment for a process that must compute as on other machines.

    outer: this process's environment; its other variables are kept. native: whether
    the process may use all features of its processor.
    """
    made = {**dict.fromkeys(THREADS, "1"), **outer}
    if native or not _can_be_pinned():
        return made
    others, hidden = _tunables(outer)
    hidden = [*FUSED, *(one for one in hidden if one not in FUSED)]
    made[TUNABLES] = ":".join([*others, f"{HWCAPS}={','.join(hidden)}"])
    # numpy refuses an unknown name, and one that every processor must have, so we ask
    # numpy. It does not find features that the outer environment has switched off.
    off = {one for one in outer.get(DISABLE, "").replace(",", " ").split() if one}
    if made.pop(ENABLE, None) is not None:  # numpy refuses both together
        off |= set(_simd("not found"))
    if off := off | set(_simd("found")):
        made[DISABLE] = ",".join(sorted(off))
    made[BLAS] = KERNELS
    return made


def describe(settings: Mapping[str, str] | None = None) -> str:
    """Return in a line what a process with these settings (this one's) computes with.

    `Linux x86_64, glibc 2.36, numpy 2.4.6, pinned`. Processes with the same line agree
    to the last bit, except for results of other libraries.
    """
    settings = os.environ if settings is None else settings
    words = [*_system(), f"numpy {np.__version__}"]
    pinned = _can_be_pinned() and environment(settings) == {
        **dict.fromkeys(THREADS, "1"),
        **settings,
    }
    if pinned:
        words.append("pinned")
    else:
        words.append(" ".join(["native", *_simd("found"), *_tunables(settings)[1]]))
    return ", ".join(word for word in words if word)


class Platforms:
    """Platforms of the members of one run, each as the line of `describe`."""

    def __init__(self) -> None:
        self._told: dict[str, str] = {}

    def news(self, who: str, line: str) -> str:
        """Return a warning for the first member on each further platform, else ""."""
        if not line or line in self._told:
            return ""
        self._told[line] = who
        (first, other), *_ = self._told.items()
        if line == first:
            return ""
        return (
            f"{who} computes on {line}, and {other} on {first}: what they record "
            "may differ in its last digits from a run on one of them alone."
        )


def _system() -> tuple[str, str]:
    """Return this system with its processor, and its version or that of its library."""
    if sys.platform == "win32":
        # Not by `platform`: it asks a service of Windows, and every host would wait.
        version = ".".join(str(number) for number in sys.getwindowsversion()[:3])
        return f"Windows {os.environ.get('PROCESSOR_ARCHITECTURE', '')}", version
    library = platform.mac_ver()[0]
    if sys.platform == "linux":
        library = " ".join(platform.libc_ver())
    return f"{platform.system()} {platform.machine()}", library.strip()


def _can_be_pinned() -> bool:
    if sys.platform != "linux" or platform.machine() != "x86_64":
        return False
    return platform.libc_ver()[0] == "glibc"


def _tunables(settings: Mapping[str, str]) -> tuple[list[str], list[str]]:
    """Return glibc's other tunables, and the processor features in them."""
    given = [one for one in settings.get(TUNABLES, "").split(":") if one]
    features = [one for one in given if one.startswith(f"{HWCAPS}=")]
    others = [one for one in given if one not in features]
    names = [n for one in features for n in one.partition("=")[2].split(",") if n]
    return others, names


def _simd(which: str) -> list[str]:
    """Return numpy's features beyond its baseline that are `found` here, or not."""
    told: Any = np.show_config(mode="dicts")
    return list(told.get("SIMD Extensions", {}).get(which, ()))
