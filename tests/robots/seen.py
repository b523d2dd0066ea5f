"""The picture of docs/camera.md: `python -m tests.robots.seen`.

It prints the figures of docs/measured/accuracy.md, too.

Of an e-puck that looks at a ball, a crate, a can and a Woodbot: by MuJoCo on the
left, by PyBullet on the right. Then what a picture costs here.
"""

from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from rems_net import Experiment
from rems_net.agents.ports import Out
from rems_net.agents.robot import combine
from rems_net.bodies.body import Camera
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.drivers.physics.pybullet import Pybullet
from rems_net.pictures import png
from rems_net.robots.epuck import Epuck, EpuckWithCamera
from rems_net.robots.sensing import sensed

PICTURE = Path(__file__).parent.parent.parent / "docs" / "camera.png"
#: a pixel of the camera is so many on the page, and a gap between the two
ZOOM, GAP = 6, 12
SIZES = ((52, 39), (160, 120), (320, 240), (640, 480))
PLACE: dict[str, Any] = {
    "size": [1.6, 1.2],
    "balls": [{"name": "ball", "radius": 0.03, "x": 0.25, "y": 0.08}],
    "boxes": [
        {"name": "crate", "size": [0.06] * 3, "x": 0.3, "y": -0.1, "heading": 0.5}
    ],
    "cylinders": [{"name": "can", "radius": 0.02, "height": 0.1, "x": 0.6, "y": 0.06}],
}


def seen(driver: str) -> Any:
    """What the e-puck sees, (39, 52, 3)."""
    lab = Experiment("seen", dt="50 ms", duration="1 s")
    lab.world("arena", options=PLACE)
    lab.robot("bot", "epuck_camera", driver, world="arena")
    start = {"x": 0.42, "y": 0.01, "heading": 2.4}
    lab.robot("other", "woodbot", driver, world="arena", initial=start)
    agents = lab.check()
    robots: list[Any] = [agents["robot/bot"], agents["robot/other"]]
    for robot in robots:
        robot.open()
    picture = robots[0].sensors["camera"]
    for robot in robots:
        robot.close()
    return picture


def cost(driver: type, width: int, height: int) -> float:
    """CPU time of a picture of this size, ms: the least of five times ten."""
    eye = Camera("camera", (0.03, 0, 0.008), (1.0, 0, 0), width, height, 0.84)
    senses = (*Epuck.senses, eye)
    about = {"senses": senses, "sensors": Out(sensed("eyes", senses, "a trial"))}
    large = type("Large", (EpuckWithCamera,), about)
    best = []
    for definition in (large, Epuck):
        robot = combine(definition, driver)("r", parameters={"arena_radius": 0.4})
        robot.prepare()
        robot.open()
        spans = []
        for _ in range(5):
            begun = process_time()
            for _ in range(10):
                robot.sense()
            spans.append((process_time() - begun) / 10)
        robot.close()
        best.append(min(spans))
    return 1000 * (best[0] - best[1])


def main() -> None:
    """Draw, and measure."""
    pair = [
        picture.repeat(ZOOM, 0).repeat(ZOOM, 1)
        for picture in map(seen, ("mujoco", "pybullet"))
    ]
    gap = np.full((pair[0].shape[0], GAP, 3), 255, np.uint8)
    PICTURE.write_bytes(png(np.hstack([pair[0], gap, pair[1]])))
    print(f"docs/camera.png: {PICTURE.stat().st_size / 1000:.1f} kB")
    for size in SIZES:
        both = (f"{cost(driver, *size):5.1f} ms" for driver in (Mujoco, Pybullet))
        print(f"{size[0]} x {size[1]}:", *both)


if __name__ == "__main__":
    main()
