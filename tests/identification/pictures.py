"""The pictures of docs/identification.md: `python -m tests.identification.pictures`.

A robot of another hand drives 40 s, from which its parameters are identified and its
residual is learned; then another 20 s, which are predicted.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rems_net import Woodbot
from rems_net.identification.drive import Drive
from rems_net.identification.identify import identify
from tests.processes.beside import (
    Parameters,
    error,
    free_run,
    late,
    learned,
)

DOCS = Path(__file__).parents[2] / "docs"
CLASS: Parameters = {"arena_radius": "0 m"}
#: the robot's own, which nobody knows
HAND = {"track": "104 mm", "max_wheel_speed": "6.6 rad/s"}
NAMES = ("class constants", "track, speed", "corrected", "motors, too")
#: Okabe and Ito's colours, which colour-blind people can tell apart
COLOURS = ("#D55E00", "#0072B2", "#009E73", "#CC79A7")
Way = tuple[Parameters, Path | None]


def ways(folder: Path) -> list[Way]:
    """Return parameters and weights of each prediction."""
    seen, path = late(3, 60.0, 0.05, 2, **HAND), folder / "weights.json"
    some = identify([seen], Woodbot, parameters=CLASS, names=[*HAND]).adopted()
    every = identify([seen], Woodbot, parameters=CLASS).adopted()
    print("identified:", some, every)
    weights = learned(seen, CLASS | some)
    assert weights.helps
    weights.write(path)
    found = CLASS | some
    return [(CLASS, None), (found, None), (found, path), (CLASS | every, None)]


def fit(drive: Drive, all_ways: list[Way], path: Path) -> None:
    """Draw where the robot went in 10 s, and where it was predicted."""
    figure = Figure(figsize=(6.4, 3.4), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2, width_ratios=(1, 1.2))
    rows = slice(0, 101)
    time, x, y = drive.time[rows], drive.state["x"][rows], drive.state["y"][rows]
    left.plot(x, y, color="0.1", lw=4, alpha=0.25)
    for name, colour, (found, weights) in zip(NAMES, COLOURS, all_ways, strict=True):
        went = free_run(drive, found, weights, 0, 100)
        left.plot(went[:, 0], went[:, 1], color=colour, lw=1.2)
        off = 1000 * np.hypot(went[:, 0] - x, went[:, 1] - y)
        right.plot(time, off, color=colour, lw=1.2, label=name)
    left.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    right.set(xlabel="time [s]", ylabel="distance from the robot [mm]")
    right.plot([], [], color="0.1", lw=4, alpha=0.25, label="measured")
    right.legend(frameon=False)
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(color="0.92")
    figure.savefig(path, dpi=110)


def held_out(drive: Drive, all_ways: list[Way], path: Path) -> None:
    """Draw the error after 1 s and 10 s of free runs, as bars."""
    figure = Figure(figsize=(6.4, 2.3), layout="constrained")
    FigureCanvasAgg(figure)
    for axes, seconds in zip(figure.subplots(1, 2), (1.0, 10.0), strict=True):
        errors = [1000 * error(drive, *way, seconds) for way in all_ways]
        print(f"{seconds:g} s:", dict(zip(NAMES, errors, strict=True)))
        bars = axes.barh(NAMES, errors, color=COLOURS)
        axes.bar_label(bars, fmt="%.1f", padding=3, fontsize=8)
        axes.set(title=f"after {seconds:g} s", xlabel="RMS distance [mm]")
        axes.margins(x=0.15)
        axes.invert_yaxis()
        axes.spines[["top", "right"]].set_visible(False)
        if seconds > 1:
            axes.set_yticklabels([])
    figure.savefig(path, dpi=110)


def main() -> None:
    mpl.rcParams["font.size"] = 8
    with TemporaryDirectory() as folder:
        all_ways, other = ways(Path(folder)), late(11, 20.0, 0.05, 2, **HAND)
        fit(other, all_ways, DOCS / "identified.png")
        held_out(other, all_ways, DOCS / "held_out.png")


if __name__ == "__main__":
    main()
