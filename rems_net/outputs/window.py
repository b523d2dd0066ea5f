"""The window of PlotOutput: `python -m rems_net.outputs.window HEAD`.

HEAD is JSON: title, names, units, and whether the values are paths. Each line on the
standard input is a row: time [s] and the values. Its end closes the window.
"""

import json
import os
import sys
from collections import deque
from itertools import groupby
from threading import Thread
from typing import Any

from rems_net.system.standard_input import lines

#: points of a line; of more, every second one is kept
POINTS = 4000
#: s between two pictures, at least
PAUSE = 0.05
#: s of pause for each second of processor time that a picture takes: agents go first
SHARE = 4.0
#: s. A pause is no longer than this, so that a window closes soon.
LONGEST = 1.0
#: bytes of a row, at most
ROW = 2**24
#: rows that wait to be drawn
ROWS: deque[list[Any] | None] = deque(maxlen=20_000)


class Lines:
    """The lines of a figure, one for each field, or for each robot's path."""

    def __init__(self, head: dict[str, Any], figure: Any):
        self._paths, names = head["paths"], head["names"]
        figure.suptitle(head["title"])
        self._columns: list[list[float]] = [[] for _ in range(len(names) + 1)]
        self._lines: list[tuple[Any, int, int]] = []
        if self._paths:
            axes = figure.add_subplot()
            axes.set(xlabel=f"x [{head['units'][0]}]", ylabel=f"y [{head['units'][1]}]")
            axes.set_aspect("equal", adjustable="datalim")
            for i in range(0, len(names), 2):
                name = names[i].split("/")[1]
                self._lines.append((axes.plot([], [], label=name)[0], i + 1, i + 2))
        else:
            pairs = sorted(zip(head["units"], range(len(names)), strict=True))
            groups = [[*some] for _, some in groupby(pairs, key=lambda pair: pair[0])]
            above: Any = None
            for k, some in enumerate(groups):
                axes = figure.add_subplot(len(groups), 1, k + 1, sharex=above)
                above = axes
                axes.set_ylabel(f"[{some[0][0]}]" if some[0][0] else "")
                for _, i in some:
                    line = axes.plot([], [], label=names[i])[0]
                    self._lines.append((line, 0, i + 1))
            above.set_xlabel("time [s]")
        for axes in figure.axes:
            axes.grid(alpha=0.3)
            above = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "ncols": 4}
            axes.legend(**above, fontsize="small", frameon=False)
        self._figure = figure

    def add(self, row: list[Any]) -> None:
        """Add the values of a tick; a value that is not there leaves a gap."""
        for column, value in zip(self._columns, row, strict=True):
            column.append(float("nan") if value is None else value)
        if len(self._columns[0]) > POINTS:
            self._columns = [column[::2] for column in self._columns]

    def draw(self) -> None:
        """Show all that was added."""
        for line, x, y in self._lines:
            line.set_data(self._columns[x], self._columns[y])
        for axes in self._figure.axes:
            axes.relim()
            axes.autoscale_view()
        self._figure.canvas.draw_idle()


def read() -> None:
    """Take rows from the standard input; None is their end."""
    for line in lines(ROW):
        ROWS.append(json.loads(line))
    ROWS.append(None)


def main(head: dict[str, Any]) -> str:
    """Show the window until the rows end; return why it cannot be shown, or ""."""
    if hasattr(os, "nice"):  # agents go first
        os.nice(10)
    try:
        from matplotlib import pyplot as plt
    except ImportError:
        return 'the figure needs matplotlib; type: pip install "rems-net[plot]"'
    figure = plt.figure(head["title"], layout="constrained")
    if not hasattr(figure.canvas, "manager") or plt.get_backend().lower() == "agg":
        return "matplotlib finds no library for windows here, such as tkinter"
    lines = Lines(head, figure)
    plt.show(block=False)
    Thread(target=read, daemon=True).start()
    going, pause = True, PAUSE
    while going and plt.fignum_exists(figure.number):
        new, begun = bool(ROWS), os.times().user
        while ROWS and going:
            row = ROWS.popleft()
            going = row is not None
            if row is not None:
                lines.add(row)
        if new:
            lines.draw()
        figure.canvas.start_event_loop(pause)
        pause = min(max(PAUSE, SHARE * (os.times().user - begun)), LONGEST)
    return ""


if __name__ == "__main__":
    try:
        trouble = main(json.loads(sys.argv[1]))
    except Exception as error:  # such as a display that refuses
        trouble = f"no window can be shown: {str(error).splitlines()[0]}"
    print(trouble)
    sys.exit(1 if trouble else 0)
