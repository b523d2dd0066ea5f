"""Cost against size: ticks per second for 1, 10, 100, 1000 agents, as a picture."""

from __future__ import annotations

from pathlib import Path

from benchmarks.contest import Contender, Spread, Tell, interleave
from benchmarks.report import Section, table

TITLE = "Cost against size"
SIZES = (1, 10, 100, 1000)
OWN, UNWATCHED, WATCHED = (
    "a process each, watched",
    "2 hosts, unwatched",
    "2 hosts, watched",
)
PICTURE = "cost_against_size.svg"
#: colour (Okabe and Ito's, which colour-blind people can tell apart), marker, and
#: where figures stand, such that lines that meet do not hide them
LOOKS = {
    OWN: ("#0072B2", "o", (-26, -12)),
    UNWATCHED: ("#009E73", "s", (6, 6)),
    WATCHED: ("#D55E00", "^", (6, 5)),
}

TEXT = """Ticks per second of lock-step runs of 1 to 1000 agents: small robots in a
process each, and kinematic Woodbots in two hosts. Watched: every state is put on its
own key and received by one subscriber. Lines go from the slowest to the fastest run."""


def measure(repeats: int, quick: bool, tell: Tell, folder: Path) -> Section:
    rates: dict[str, dict[int, Spread]] = {name: {} for name in LOOKS}
    for size in SIZES[:2] if quick else SIZES:
        ticks = 50 if quick else max(200, 3000 // size)
        contenders = [
            Contender(UNWATCHED, "swarm", (size, 4 * ticks, "unwatched", min(2, size))),
            Contender(WATCHED, "swarm", (size, ticks, "apart", min(2, size))),
        ]
        if size <= 100:
            contenders.append(Contender(OWN, "rems", (size, ticks)))
        tell(f"{size} agents")
        found = interleave(contenders, repeats, tell)
        for name, runs in found.runs.items():
            if runs:
                rates[name][size] = found.spread(name)
    rows = [
        [name, *(f"{line[n].median:.0f}" if n in line else "-" for n in SIZES)]
        for name, line in rates.items()
    ]
    drawn = draw(rates, folder / PICTURE)
    text = [TEXT, table(["ticks/s", *(f"{n}" for n in SIZES)], rows)]
    if drawn:
        text.append(f"![Ticks per second against the number of agents]({PICTURE})")
    return Section("size", TITLE, text)


def draw(rates: dict[str, dict[int, Spread]], path: Path) -> bool:
    """Draw medians, with lines from the smallest to the largest of the runs."""
    try:
        import matplotlib
    except ImportError:
        return False
    matplotlib.use("Agg")
    matplotlib.rcParams["svg.hashsalt"] = "rems_net"
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(6.4, 4), layout="constrained")
    for name, line in rates.items():
        colour, marker, offset = LOOKS[name]
        middle = [s.median for s in line.values()]
        below = [s.median - min(s.values) for s in line.values()]
        above = [max(s.values) - s.median for s in line.values()]
        axes.errorbar(
            list(line),
            middle,
            [below, above],
            label=name,
            color=colour,
            marker=marker,
            capsize=3,
        )
        for size, rate in list(zip(line, middle, strict=True))[1:]:
            axes.annotate(
                f"{rate:.0f}",
                (size, rate),
                offset,
                textcoords="offset points",
                color=colour,
                fontsize=8,
            )
    axes.set(xscale="log", yscale="log", xlabel="agents", ylabel="ticks per second")
    axes.set_xticks(SIZES, [f"{n}" for n in SIZES])
    axes.yaxis.set_major_formatter("{x:.0f}")
    axes.margins(x=0.1, y=0.12)
    axes.grid(True, which="major", color="0.9")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, loc="lower left")
    figure.savefig(path, metadata={"Date": None})
    pyplot.close(figure)
    return True
