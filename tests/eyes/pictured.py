"""The picture of docs/eyes.md: `python -m tests.eyes.pictured`.

Left, the picture of a camera at 45 degrees; right, of one straight above. The found
poses are drawn into both: an arrow along each heading.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rems_net import Experiment
from rems_net.bodies.lens import Lens
from rems_net.eyes.view import View, turn_of
from rems_net.pictures import png
from tests.commands import ROOT

PICTURE = ROOT / "docs" / "eyes.png"
#: m. Length of an arrow, and its height: that of a marker on a Woodbot.
ARROW, HEIGHT = 0.09, 0.0405
STARTS = {
    "ann": (0.1, 0.12, 0.4),
    "ben": (-0.12, 0.05, 2.6),
    "cem": (0.05, -0.13, -1.0),
}
CAMERAS = {
    "aside": {"x": -0.36, "z": 0.36, "pitch": "-45 deg"},
    "above": {"z": 0.62},
}


def main() -> None:
    """Draw it."""
    lab = Experiment("eyes", dt="50 ms", duration="1 s")
    crate = {"name": "crate", "size": [0.08, 0.06, 0.05], "x": 0.2, "y": -0.05}
    mark = {"id": 9, "size": "40 mm", "on": "crate"}
    lab.world("arena", options={"boxes": [crate], "markers": [mark]})
    for number, (name, (x, y, heading)) in enumerate(STARTS.items(), 1):
        start = {"x": x, "y": y, "heading": heading}
        marker = {"id": number, "size": "40 mm", "x": "-35 mm"}
        lab.robot(
            name, "woodbot", "mujoco", world="arena", initial=start, marker=marker
        )
    for name, place in CAMERAS.items():
        parameters = {"width": 480, "height": 360, "place": place}
        lab.robot(name, "camera", "mujoco", world="arena", parameters=parameters)
        lab.process(f"by_{name}", "localise", camera=f"robot/{name}/sensors")
    shown = []
    with lab.engine() as engine:
        engine.step()
        for name in CAMERAS:
            sensors = engine[f"robot/{name}"].sensors
            drawn = sensors["picture"].copy()
            for row in engine[f"process/by_{name}"].poses.seen:
                _arrow(drawn, _view(sensors), row)
            shown.append(drawn)
    gap = np.full((shown[0].shape[0], 12, 3), 255, np.uint8)
    PICTURE.write_bytes(png(np.hstack([shown[0], gap, shown[1]])))
    print(f"docs/eyes.png: {PICTURE.stat().st_size / 1000:.1f} kB")


def _view(sensors: Any) -> View:
    lens, place = sensors["lens"], sensors["place"]
    height, width, _ = sensors["picture"].shape
    four = {name: lens[name] for name in ("fx", "fy", "cx", "cy")}
    turn = turn_of(place["heading"], place["pitch"], place["roll"])
    eye = np.array([place["x"], place["y"], place["z"]])
    return View.at(Lens(width, height, **four), eye, turn)


def _arrow(picture: Any, view: View, row: Any) -> None:
    """Draw an arrow along a pose's heading, in red."""
    x, y, heading = row["x"], row["y"], row["heading"]
    way = np.array([np.cos(heading), np.sin(heading)])
    tip, side = ARROW * way, 0.018 * np.array([-way[1], way[0]])
    for first, last in [
        (0 * tip, tip),
        (tip, 0.75 * tip + side),
        (tip, 0.75 * tip - side),
    ]:
        ends = np.array([first, last]) + np.array([x, y])
        (begin, end), _ = view.project(np.column_stack([ends, [HEIGHT] * 2]))
        for share in np.linspace(0, 1, 200):
            column, line = np.round(begin + share * (end - begin)).astype(int)
            picture[line - 1 : line + 1, column - 1 : column + 1] = (220, 30, 30)


if __name__ == "__main__":
    main()
