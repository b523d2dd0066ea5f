"""A film of a recording, by the suffix of its file. Needs Pillow."""

import shutil
import subprocess
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from rems_net.errors import ExperimentError, MissingPartError
from rems_net.libraries import needed
from rems_net.recordings.animation.stage import (
    FAR,
    circle,
    outline,
    placed,
    stage,
    things,
)
from rems_net.recordings.comparison import Trajectory
from rems_net.recordings.picture import COLOURS, FAINT, INK, WALL

#: pixels; in each direction, before they are made smaller for smooth edges
SIZE, SMOOTH = (640, 480), 2
#: pictures a second of the film; most of them
RATE, MOST = 20, 1200
#: robots that are named
NAMED = 12
#: by the end of a file's name: what Pillow calls it, and how it is saved
FORMATS: dict[str, tuple[str, dict[str, Any]]] = {
    ".png": ("PNG", {"default_image": False}),
    ".apng": ("PNG", {"default_image": False}),
    ".gif": ("GIF", {"disposal": 1}),
    ".webp": ("WEBP", {"lossless": True, "method": 3}),
}
FFMPEG = ".mp4"


class View(Protocol):
    """Pictures of a recording at any time from `begin` to `end`, s.

    names: of the robots, in the order of their colours.
    """

    names: Sequence[str]
    begin: float
    end: float

    def picture(self, now: float) -> NDArray[np.uint8]:
        """Return the picture at a time [s], (height, width, 3) of SIZE."""


def film(
    view: View,
    title: str,
    path: Path,
    speed: float,
    progress: Callable[[str], object] | None = None,
) -> None:
    """Write an animated file, whose format is its suffix.

    speed: seconds of the recording in a second of the film.  progress: gets a line
    for each picture. Raises MissingPartError without Pillow or ffmpeg, ExperimentError
    for another format, OSError.
    """
    suffix = path.suffix.lower()
    if suffix not in (*FORMATS, FFMPEG):
        raise ExperimentError(
            f"{path.name} has no format that is known; expected a name that ends with "
            f"{', '.join(FORMATS)} or {FFMPEG}. (R0842)"
        )
    pictures = _pictures(view, title, speed, progress)
    if suffix == FFMPEG:
        _mp4(pictures, path)
        return
    first = next(pictures)
    name, how = FORMATS[suffix]
    lasts = round(1000 / RATE)
    if suffix == ".gif":  # one palette, so that it stores only what changes
        first = first.quantize(128)
        pictures = (one.quantize(palette=first, dither=0) for one in pictures)
    how = {"save_all": True, "append_images": [*pictures], **how}
    first.save(path, name, duration=lasts, loop=0, **how)  # 0: for ever


def _mp4(pictures: Iterator[Any], path: Path) -> None:
    program = shutil.which("ffmpeg")
    if program is None:
        raise MissingPartError(
            "An MP4 file needs the program ffmpeg, which is not installed here; an "
            "animated PNG does not: --out film.png (R0301)"
        )
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", "{}x{}".format(*SIZE)]
    words = [program, "-loglevel", "error", "-y", *raw, "-r", str(RATE), "-i", "-"]
    words += ["-pix_fmt", "yuv420p", str(path)]
    with subprocess.Popen(words, stdin=subprocess.PIPE) as made:
        assert made.stdin is not None
        for picture in pictures:
            made.stdin.write(picture.tobytes())
        made.stdin.close()
    if made.returncode:
        raise ExperimentError(
            f"ffmpeg has not written {path}; its own message is above. An animated "
            "PNG needs no ffmpeg: --out film.png (R0842)"
        )


def _pictures(
    view: View, title: str, speed: float, progress: Callable[[str], object] | None
) -> Iterator[Any]:
    """Yield the pictures of a film."""
    image, draw, fonts = _pillow()
    count = int(np.ceil((view.end - view.begin) / speed * RATE)) + 1
    if count > MOST:
        raise ExperimentError(
            f"that is a film of {count} pictures, and {MOST} is the most; make it "
            f"faster: --speed {np.ceil(speed * count / MOST):g} (R0842)"
        )
    font = fonts.load_default(13)
    times = np.minimum(view.begin + np.arange(count) * speed / RATE, view.end)
    for number, now in enumerate(times.tolist(), 1):
        picture = image.fromarray(view.picture(now))
        pen = draw.Draw(picture)
        pen.text((8, 8), title, INK, font)
        for i, name in enumerate(view.names[:NAMED] if len(view.names) > 1 else ()):
            pen.text((8, 26 + 16 * i), name, COLOURS[i % len(COLOURS)], font)
        pen.text((SIZE[0] - 8, 8), f"{now:.2f} s", INK, font, "ra")
        yield picture
        if progress is not None:
            progress(f"picture {number} of {count}")


def _pillow() -> tuple[Any, Any, Any]:
    """Return Pillow's modules. Raises MissingPartError."""
    with needed("Pillow", "animate", "A film"):
        from PIL import Image, ImageDraw, ImageFont
    return Image, ImageDraw, ImageFont


class FromAbove:
    """Robots from above, with their trails."""

    def __init__(self, robots: Sequence[Trajectory]):
        """Raise ExperimentError if there is nothing to draw."""
        if not robots:
            raise ExperimentError(
                "no robot of this recording has x, y and heading, so there is nothing "
                "to animate from above; draw its fields by rems plot, or type rems "
                "animate --3d. (R0845)"
            )
        self._robots = robots
        self.names: Sequence[str] = [robot.name for robot in robots]
        self._drawn = [robot.drawn() for robot in robots]
        self.begin = min(float(time[0]) for time, *_ in self._drawn)
        self.end = max(float(time[-1]) for time, *_ in self._drawn)
        width, height = (SMOOTH * n for n in SIZE)
        self._view = stage(robots, (width, height))

    @cached_property
    def _ground(self) -> Any:
        """Things and walls, which do not move."""
        image, draw, _ = _pillow()
        robots, view = self._robots, self._view
        ground = image.new("RGB", view.size, "white")
        pen = draw.Draw(ground)
        for _, corners in things(robots):
            pen.polygon(view.at(corners), FAINT, WALL)
        seen = max(view.size) / view.scale
        for radius in {robot.arena for robot in robots} - {0.0}:
            if radius <= FAR * seen:
                pen.line(view.at(circle(radius)), WALL, 3 * SMOOTH)
        return ground

    def picture(self, now: float) -> NDArray[np.uint8]:
        """Return the picture at a time [s]."""
        image, draw, _ = _pillow()
        picture, view = self._ground.copy(), self._view
        pen = draw.Draw(picture)
        for i, (robot, (time, *pose)) in enumerate(
            zip(self._robots, self._drawn, strict=True)
        ):
            colour = COLOURS[i % len(COLOURS)]
            x, y, heading = (float(np.interp(now, time, part)) for part in pose)
            gone = time < now
            trail = np.stack((np.r_[pose[0][gone], x], np.r_[pose[1][gone], y]), axis=1)
            if len(trail) > 1:
                pen.line(view.at(trail), colour, 2 * SMOOTH, joint="curve")
            body = view.at(placed(outline(robot), x, y, heading))
            pen.line([*body, body[0]], colour, 2 * SMOOTH, joint="curve")
            if len(robot.outline):  # an arrow has a tip already
                tip = np.array([[0.0, 0.0], [robot.outline[:, 0].max(), 0.0]])
                pen.line(view.at(placed(tip, x, y, heading)), colour, 2 * SMOOTH)
        return np.asarray(picture.resize(SIZE, image.Resampling.BOX))
