"""Cost of recordings that are the same bytes on every laptop."""

from __future__ import annotations

from benchmarks.contest import Contender, Table, Tell, interleave
from benchmarks.report import Section, Target, table

TITLE = "The same bytes on every laptop"
MATHS, PINNED, NATIVE = "maths", "pinned", "native"

TEXT = """`rems_net.maths` computes its functions in products, sums and roots, and C
libraries with every feature of the processor ([why](../results.md)). Microseconds of
one call, of a number and of an array of 1000; `sincos` in numpy are two calls."""
STEPS = """Pinned hosts use only what every processor has, and those of
`rems run --native` everything. Both columns are measured in such processes: one step of
0.1 s of a kinematic Woodbot, of 1000 in a host, of one in MuJoCo; and numpy's `exp` of
1000 numbers and product of two matrices of 200 x 200:"""
LABELS = {
    "kinematic": "kinematic Woodbot",
    "swarm": "1000 kinematic Woodbots",
    "mujoco": "Woodbot in MuJoCo",
    "exp": "numpy.exp",
    "matrices": "product of matrices",
}


def measure(repeats: int, quick: bool, tell: Tell) -> Section:
    contenders = [
        Contender(MATHS, "numerics", ("maths",)),
        Contender(PINNED, "numerics", ("pinned",)),
        Contender(NATIVE, "numerics", ("native",)),
    ]
    found = interleave(contenders, repeats, tell)
    text = [TEXT, _functions(found), STEPS, _steps(found)]
    text += [f"Left out: {reason}" for reason in found.missing.values()]
    targets = [
        Target(f"{LABELS[what]}, pinned over native", ratio, 1.1, at_least=False)
        for what in ("kinematic", "swarm", "mujoco")
        if _has(found, what) and (ratio := found.ratio(PINNED, NATIVE, what))
    ]
    return Section("numerics", TITLE, text, targets)


def _has(found: Table, what: str) -> bool:
    """Whether it was measured; MuJoCo may not be installed."""
    return all(what in run for name in (PINNED, NATIVE) for run in found.runs[name])


def _functions(found: Table) -> str:
    rows = []
    for name in ("sin", "exp", "atan2", "hypot"):
        ours = found.spread(MATHS, f"{name} maths").median
        row = [f"`{name}`", f"{ours:.2f}"]
        for by in ("math", "numpy"):
            row.append(f"{ours / found.spread(MATHS, f'{name} {by}').median:.1f}")
        rows.append([*row, *_arrays(found, name)])
    rows.append(["`sincos`", "", "", "", *_arrays(found, "sincos")])
    head = ["", "number [us]", "over `math`", "over numpy", "array [us]", "over numpy"]
    return table(head, rows)


def _arrays(found: Table, name: str) -> list[str]:
    ours = found.spread(MATHS, f"{name}s maths").median
    return [
        f"{ours:.1f}",
        f"{ours / found.spread(MATHS, f'{name}s numpy').median:.1f}",
    ]


def _steps(found: Table) -> str:
    rows = [
        [
            label,
            found.spread(PINNED, what).show(".1f"),
            found.spread(NATIVE, what).show(".1f"),
            found.ratio(PINNED, NATIVE, what).show(),
        ]
        for what, label in LABELS.items()
        if _has(found, what)
    ]
    return table(["", "pinned [us]", "native [us]", "pinned over native"], rows)
