"""A picture that compares trajectories. Needs matplotlib, and no display."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rems_net.errors import MissingPartError
from rems_net.recordings.comparison import APART, Pair, Trajectory

#: Okabe and Ito's colours, which colour-blind people tell apart; dark ones first.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
#: Where lines lie on one another, the lower ones show between the dashes.
DASHES = ("solid", (0, (5, 2)), (0, (1.5, 1.5)), (0, (6, 2, 1.5, 2)))
INK, FAINT = "#333333", "#DDDDDD"
#: More pairs than this are drawn against the first robot only.
MANY = 6


def draw(
    path: Path, title: str, robots: Sequence[Trajectory], pairs: Sequence[Pair]
) -> None:
    """Draw where the robots drove, how far they were apart, and their headings.

    Raises MissingPartError without matplotlib.
    """
    try:
        from matplotlib import rc_context
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingPartError(
            f"The picture needs matplotlib, which cannot be imported ({error}). "
            'Type: pip install "rems-net[plot]"'
        ) from None
    with rc_context({"font.size": 9.5, "axes.titlesize": 10.5, "text.color": INK}):
        figure = Figure(figsize=(11, 5.6), layout="constrained", facecolor="white")
        FigureCanvasAgg(figure)
        grid = figure.add_gridspec(2, 2, width_ratios=(1.15, 1))
        figure.suptitle(title, fontsize=13, fontweight="bold", x=0.01, ha="left")
        _paths(figure.add_subplot(grid[:, 0]), robots)
        _distances(figure.add_subplot(grid[0, 1]), robots, pairs)
        _headings(figure.add_subplot(grid[1, 1]), robots)
        figure.savefig(path, dpi=150)


def _style(i: int) -> dict[str, Any]:
    return {
        "color": COLOURS[i % len(COLOURS)],
        "linestyle": DASHES[i % len(DASHES)],
        "linewidth": 2.4 - 0.25 * min(i, 4),
    }


def _plain(axes: Any, title: str, x: str, y: str) -> None:
    axes.set_title(title, loc="left")
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(color=FAINT, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(color=FAINT)
    for side, spine in axes.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_color(FAINT)


def _paths(axes: Any, robots: Sequence[Trajectory]) -> None:
    _plain(axes, "Where they drove", "x [m]", "y [m]")
    for i, robot in enumerate(robots):
        style = _style(i)
        axes.plot(robot.x, robot.y, label=robot.name, **style)
        start = {"markersize": 11, "markerfacecolor": "none", "zorder": 4}
        end = {"markersize": 7, "markeredgecolor": "white", "zorder": 5}
        axes.plot(robot.x[:1], robot.y[:1], "o", color=style["color"], **start)
        axes.plot(robot.x[-1:], robot.y[-1:], "s", color=style["color"], **end)
    axes.plot([], [], "o", color=INK, markerfacecolor="none", label="start")
    axes.plot([], [], "s", color=INK, label="end")
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend(frameon=False, loc="best", ncols=1 + len(robots) // 10)


def _distances(axes: Any, robots: Sequence[Trajectory], pairs: Sequence[Pair]) -> None:
    _plain(axes, "How far they were apart", "time [s]", "distance [mm]")
    shown = pairs
    if len(pairs) > MANY:
        shown = [pair for pair in pairs if pair.a == robots[0].name]
    names = [robot.name for robot in robots]
    for i, pair in enumerate(shown):
        # Against the first robot, a pair has the colour of the other one.
        k = names.index(pair.b) if pair.a == names[0] else len(names) + i
        label = f"{pair.a} - {pair.b}"
        axes.plot(pair.time, 1e3 * pair.distance, label=label, **_style(k))
    axes.axhline(1e3 * APART, color=INK, linewidth=0.8, linestyle=(0, (2, 3)))
    # Room above for the names.
    most = max((float(pair.distance.max()) for pair in shown), default=0.0)
    axes.set_ylim(0, 1.75e3 * max(most, APART))
    axes.annotate(
        "10 mm",
        (1, 1e3 * APART),
        xycoords=("axes fraction", "data"),
        ha="right",
        va="bottom",
        fontsize=8,
    )
    if shown:
        axes.legend(frameon=False, loc="upper left", ncols=1 + len(shown) // 5)


def _headings(axes: Any, robots: Sequence[Trajectory]) -> None:
    _plain(axes, "Where they headed", "time [s]", "heading [deg]")
    for i, robot in enumerate(robots):
        axes.plot(robot.time, np.degrees(np.unwrap(robot.heading)), **_style(i))
