"""Numerics: what a process computes with, and how processes are made to agree.

The C library, numpy and OpenBLAS each choose their code by the processor they find.
One that multiplies and adds in one step rounds once where others round twice, so a
recording would say in its last digits on which laptop it was made. On Linux with glibc
on x86-64 each of the three can be told, by the environment that a process starts with,
to do what every such processor can do.
"""

import os
import platform
from collections.abc import Mapping
from typing import Any

import numpy as np

TUNABLES, HWCAPS = "GLIBC_TUNABLES", "glibc.cpu.hwcaps"
#: what glibc shall not use; `_Usable` is their name before glibc 2.33. Others it passes
#: over. Without them none of its variants of sin, exp, pow, ... fuses.
FUSED = ("-FMA", "-FMA4", "-FMA_Usable", "-FMA4_Usable")
DISABLE, ENABLE = "NPY_DISABLE_CPU_FEATURES", "NPY_ENABLE_CPU_FEATURES"
#: OpenBLAS's kernels for processors of 2008 on: what numpy's wheels ask for, too
BLAS, KERNELS = "OPENBLAS_CORETYPE", "Nehalem"
#: what says how many threads linear algebra takes. One, unless told otherwise: sums of
#: several depend on how many there are, so a recording on the number of cores; and
#: starting them is half of what a process's start costs.
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


def environment(outer: Mapping[str, str], *, native: bool = False) -> dict[str, str]:
    """Return the environment for a process that shall compute as on other machines.

    outer: this process's own; what it says of other matters stays. native: whether
    the process may use all that its processor has.
    """
    made = {**dict.fromkeys(THREADS, "1"), **outer}
    if native or not _can_be_pinned():
        return made
    others, hidden = _tunables(outer)
    hidden = [*FUSED, *(one for one in hidden if one not in FUSED)]
    made[TUNABLES] = ":".join([*others, f"{HWCAPS}={','.join(hidden)}"])
    # A name that numpy does not know, or that every processor must have, it refuses; so
    # it is asked. What the outer environment has taken away, it has not found.
    off = {one for one in outer.get(DISABLE, "").replace(",", " ").split() if one}
    if made.pop(ENABLE, None) is not None:  # not both, says numpy
        off |= set(_simd("not found"))
    if off := off | set(_simd("found")):
        made[DISABLE] = ",".join(sorted(off))
    made[BLAS] = KERNELS
    return made


def describe(settings: Mapping[str, str] | None = None) -> str:
    """Say in a line what a process with these settings (this one's) computes with.

    `Linux x86_64, glibc 2.36, numpy 2.4.6, pinned`. Those with the same line agree to
    the last bit, but for what other libraries do.
    """
    settings = os.environ if settings is None else settings
    library = platform.mac_ver()[0] or " ".join(platform.win32_ver()[:2])
    if platform.system() == "Linux":
        library = " ".join(platform.libc_ver())
    words = [f"{platform.system()} {platform.machine()}", library.strip()]
    words.append(f"numpy {np.__version__}")
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
    """Those of the members of one run."""

    def __init__(self) -> None:
        self._told: dict[str, str] = {}

    def news(self, who: str, line: str) -> str:
        """A sentence, the first time that somebody comes who computes differently."""
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


def _can_be_pinned() -> bool:
    machine = platform.system(), platform.machine()
    return machine == ("Linux", "x86_64") and platform.libc_ver()[0] == "glibc"


def _tunables(settings: Mapping[str, str]) -> tuple[list[str], list[str]]:
    """Of glibc's tunables: those of other matters, and the processor's features."""
    given = [one for one in settings.get(TUNABLES, "").split(":") if one]
    features = [one for one in given if one.startswith(f"{HWCAPS}=")]
    others = [one for one in given if one not in features]
    names = [n for one in features for n in one.partition("=")[2].split(",") if n]
    return others, names


def _simd(which: str) -> list[str]:
    """What numpy can use beyond its baseline, that it has `found` here, or not."""
    told: Any = np.show_config(mode="dicts")
    return list(told.get("SIMD Extensions", {}).get(which, ()))
