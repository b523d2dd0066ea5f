"""Pictures of trajectories and fields. Needs matplotlib, and no display."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from rems_net.libraries import needed
from rems_net.recordings.animation.stage import FAR, circle, placed, things
from rems_net.recordings.comparison import APART, Pair, Trajectory, reference

#: Okabe and Ito's colours, which colour-blind people can distinguish; dark ones first.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
#: If lines overlap, the lower ones show between the dashes.
DASHES = ("solid", (0, (5, 2)), (0, (1.5, 1.5)), (0, (6, 2, 1.5, 2)))
INK, FAINT, WALL = "#333333", "#DDDDDD", "#999999"
#: pairs. If there are more, all are drawn against one robot, without where they part.
MANY = 6
#: robots with a line style and a name of their own; the others are counted
NAMED = len(COLOURS) * len(DASHES)


def draw(
    path: Path, title: str, robots: Sequence[Trajectory], pairs: Sequence[Pair]
) -> None:
    """Draw where the robots drove, how far they were apart, and their headings.

    Raises MissingPartError without matplotlib.
    """
    names = [robot.name for robot in robots]
    with page(path, title, names, paths=True, panels=1 + bool(pairs)) as (left, right):
        draw_paths(left, robots)
        if pairs:
            draw_partings(left, robots, pairs if len(pairs) <= MANY else ())
            draw_distances(right[0], names, pairs)
        draw_headings(right[-1], robots)


@contextmanager
def page(
    path: Path, title: str, names: Sequence[str], *, paths: bool, panels: int
) -> Iterator[tuple[Any, list[Any]]]:
    """Yield axes to draw on, saved at the end: a square one (or None), and wide ones.

    names: of the robots, for the legend beside the axes.
    """
    with needed("matplotlib", "plot", "The picture"):
        from matplotlib import rc_context
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
        from matplotlib.lines import Line2D
    with rc_context({"font.size": 9.5, "axes.titlesize": 10.5, "text.color": INK}):
        width, height = 12.0 if paths else 9.0, max(5.6 if paths else 3.2, 2.3 * panels)
        figure = Figure((width, height), layout="constrained", facecolor="white")
        FigureCanvasAgg(figure)
        figure.suptitle(title, fontsize=13, fontweight="bold", x=0.01, ha="left")
        grid = figure.add_gridspec(
            max(panels, 1), 2 if paths else 1, width_ratios=(1.1, 1) if paths else None
        )
        left = figure.add_subplot(grid[:, 0]) if paths else None
        right: list[Any] = []
        for i in range(panels):
            share = {"sharex": right[0]} if right else {}
            right.append(figure.add_subplot(grid[i, -1], **share))
        yield left, right
        for axes in right[:-1]:
            axes.set_xlabel("")
            axes.tick_params(labelbottom=False)
        figure.align_ylabels(right)
        shown = names[:NAMED]
        handles = [
            Line2D([], [], label=name, **style(i, len(names)))
            for i, name in enumerate(shown)
        ]
        if len(names) > len(shown):
            label = f"and {len(names) - len(shown)} more"
            handles.append(Line2D([], [], label=label, linestyle="none"))
        if paths:
            mark: dict[str, Any] = {"color": INK, "linestyle": "none"}
            empty: dict[str, Any] = {"markerfacecolor": "none", **mark}
            handles.append(Line2D([], [], label="start", marker="o", **empty))
            handles.append(Line2D([], [], label="end", marker="s", **mark))
        if handles and (paths or len(names) > 1):
            figure.legend(
                handles=handles,
                loc="outside right upper",
                frameon=False,
                fontsize=9 if len(handles) < 12 else 8,
                handlelength=2.6,
            )
        figure.savefig(path, dpi=150)


def style(i: int, count: int) -> dict[str, Any]:
    """Return the line style of robot `i` of `count`."""
    return {
        "color": COLOURS[i % len(COLOURS)],
        "linestyle": DASHES[i % len(DASHES)],
        "linewidth": 2.4 - 0.25 * min(i, 4) if count <= 6 else 1.3,
    }


def plain(axes: Any, title: str, x: str, y: str) -> None:
    """Style the axes: a title on the left, faint grid lines, nothing else."""
    axes.set_title(title, loc="left")
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(color=FAINT, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(color=FAINT)
    for side, spine in axes.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_color(FAINT)


def draw_paths(axes: Any, robots: Sequence[Trajectory]) -> None:
    """Draw the paths, from the starts, among the things of the world; to scale."""
    who = "they" if len(robots) > 1 else "it"
    plain(axes, f"Where {who} drove", "x [m]", "y [m]")
    size = 1.0 if len(robots) <= 6 else 0.6
    far = 0.0
    for i, robot in enumerate(robots):
        look, (_, x, y, _) = style(i, len(robots)), robot.drawn()
        far = max(far, float(np.hypot(x, y).max()))
        axes.plot(x, y, **look)
        colour = look["color"]
        start = {"markersize": 11 * size, "markerfacecolor": "none", "zorder": 4}
        end = {"markersize": 7 * size, "markeredgecolor": "white", "zorder": 5}
        axes.plot(x[:1], y[:1], "o", color=colour, **start)
        axes.plot(x[-1:], y[-1:], "s", color=colour, **end)
        if len(robots) <= MANY:
            _draw_robot(axes, robot, colour)
    _draw_around(axes, robots, far)
    for radius in sorted({robot.arena for robot in robots} - {0.0}):
        if radius <= FAR * far:
            axes.plot(*circle(radius).T, color=WALL, linewidth=3, zorder=1)
    axes.set_aspect("equal", adjustable="datalim")


def _draw_robot(axes: Any, robot: Trajectory, colour: str) -> None:
    """Draw the robot's outline: faintly at its start, clearly at its end."""
    _, x, y, heading = robot.drawn()
    for k, share in ((0, 0.35), (-1, 0.9)) if len(robot.outline) else ():
        corners = placed(robot.outline, x[k], y[k], heading[k])
        look = {"facecolor": "none", "edgecolor": colour, "alpha": share, "zorder": 3}
        axes.fill(*corners.T, linewidth=1.2, **look)


def _draw_around(axes: Any, robots: Sequence[Trajectory], far: float) -> None:
    """Draw the walls and things of the worlds, where they were at the start."""
    around = things(robots)
    reach = [np.hypot(*r.outline.T).max() for r in robots if len(r.outline)]
    shown = FAR * max([far, *reach])
    for name, corners in around:
        if np.hypot(*np.clip(0, corners.min(axis=0), corners.max(axis=0))) <= shown:
            limits = axes.dataLim.frozen()
            axes.fill(*corners.T, facecolor=FAINT, edgecolor=WALL, zorder=1)
            if np.hypot(*corners.T).max() > shown:  # it extends beyond the picture
                axes.dataLim.set(limits)
            if len(around) <= NAMED and not name.startswith("wall "):
                at = corners.mean(axis=0)
                look = {"ha": "center", "va": "center", "zorder": 2}
                axes.annotate(name, at, fontsize=7, color=INK, **look)


def draw_partings(
    axes: Any, robots: Sequence[Trajectory], pairs: Sequence[Pair]
) -> None:
    """Mark where each robot parted from the reference robot."""
    names = [robot.name for robot in robots]
    first = reference(names)
    for pair in pairs:
        if first in (pair.a, pair.b) and pair.parted is not None:
            robot = robots[i := names.index(pair.b if pair.a == first else pair.a)]
            k = int(np.searchsorted(robot.time, pair.parted))
            where, colour = (robot.x[k], robot.y[k]), style(i, len(names))["color"]
            axes.plot(*where, "x", color=colour, markersize=9, zorder=6)
            axes.annotate(
                f"{pair.parted:.2f} s",
                where,
                xytext=(7, 5),
                textcoords="offset points",
                fontsize=8,
                color=colour,
            )
            axes.set_title(f"Where they drove, and parted from {first} (x)", loc="left")


def draw_distances(axes: Any, names: Sequence[str], pairs: Sequence[Pair]) -> None:
    """Draw the distance of each two robots; with many, from the reference only."""
    plain(axes, "How far they were apart", "time [s]", "distance [mm]")
    shown, first = pairs, reference(names)
    if len(pairs) > MANY:
        shown = [pair for pair in pairs if first in (pair.a, pair.b)]
        axes.set_title(f"How far each was from {first}", loc="left")
    for i, pair in enumerate(shown):
        # A pair with the reference robot has the colour of the other one.
        other = pair.b if pair.a == first else pair.a
        k = names.index(other) if first in (pair.a, pair.b) else len(names) + i
        label = f"{pair.a} - {pair.b}"
        look = style(k, len(names))
        axes.plot(pair.time, 1e3 * pair.distance, label=label, **look)
    axes.axhline(1e3 * APART, color=INK, linewidth=0.8, linestyle=(0, (2, 3)))
    most = max((float(pair.distance.max()) for pair in shown), default=0.0)
    axes.set_ylim(0, 1.08e3 * max(most, APART))
    axes.annotate(
        "10 mm",
        (1, 1e3 * APART),
        xycoords=("axes fraction", "data"),
        xytext=(3, 0),
        textcoords="offset points",
        va="center",
        fontsize=8,
    )
    if 1 < len(shown) == len(pairs):
        axes.legend(
            frameon=False,
            fontsize=8,
            loc="upper left",
            bbox_to_anchor=(0, -0.04),
            ncols=3,
            borderaxespad=0,
            handlelength=2.6,
        )


def draw_headings(axes: Any, robots: Sequence[Trajectory]) -> None:
    """Draw the headings, not wrapped at a full turn."""
    who = "they" if len(robots) > 1 else "it"
    plain(axes, f"Where {who} headed", "time [s]", "heading [deg]")
    for i, robot in enumerate(robots):
        time, _, _, heading = robot.drawn()
        axes.plot(time, np.degrees(heading), **style(i, len(robots)))
