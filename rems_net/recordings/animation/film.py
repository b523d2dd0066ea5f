"""A film of a recording: robots from above, with their trails. Needs Pillow."""

import shutil
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rems_net.errors import ExperimentError, MissingPartError
from rems_net.recordings.animation.stage import (
    FAR,
    Stage,
    circle,
    outline,
    placed,
    stage,
)
from rems_net.recordings.comparison import Trajectory
from rems_net.recordings.picture import COLOURS, FAINT, INK, WALL
from rems_net.uncaught import hiding

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


def film(robots: Sequence[Trajectory], title: str, path: Path, speed: float) -> None:
    """Draw where robots drive into an animated file, whose format is its suffix.

    speed: seconds of the recording in a second of the film. Raises MissingPartError
    without Pillow or ffmpeg, ExperimentError for another format, OSError.
    """
    suffix = path.suffix.lower()
    if suffix not in (*FORMATS, FFMPEG):
        raise ExperimentError(
            f"{path.name} has no format that is known; expected a name that ends with "
            f"{', '.join(FORMATS)} or {FFMPEG}. (R0842)"
        )
    if not robots:
        raise ExperimentError(
            "no robot of this recording has x, y and heading, so there is nothing to "
            "animate; draw its fields: rems plot. (R0845)"
        )
    pictures = _pictures(robots, title, speed)
    if suffix == FFMPEG:
        _mp4(pictures, path)
        return
    first, *rest = pictures
    name, how = FORMATS[suffix]
    lasts = round(1000 / RATE)
    if suffix == ".gif":
        first, rest = _few_colours([first, *rest])
    # Loop 0: for ever.
    first.save(
        path, name, save_all=True, append_images=rest, duration=lasts, loop=0, **how
    )


def _few_colours(pictures: list[Any]) -> tuple[Any, list[Any]]:
    """Return pictures with one palette, so that a GIF stores what changes only."""
    first, *rest = pictures
    palette = first.quantize(128)
    return palette, [one.quantize(palette=palette, dither=0) for one in rest]


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


def _pictures(robots: Sequence[Trajectory], title: str, speed: float) -> Iterator[Any]:
    """Yield the pictures of a film."""
    try:
        from PIL import Image, ImageDraw, ImageFont
    except ImportError as error:
        raise MissingPartError(
            hiding(error)
            or f"A film needs Pillow, which cannot be imported ({error}). Type: "
            'pip install "rems-net[animate]" (R0301)'
        ) from None
    width, height = (SMOOTH * n for n in SIZE)
    view, font = stage(robots, (width, height)), ImageFont.load_default(13 * SMOOTH)
    ground = Image.new("RGB", (width, height), "white")
    _scenery(ImageDraw.Draw(ground), robots, view, title, font)
    drawn = [robot.drawn() for robot in robots]
    begin = min(float(time[0]) for time, *_ in drawn)
    end = max(float(time[-1]) for time, *_ in drawn)
    count = int(np.ceil((end - begin) / speed * RATE)) + 1
    if count > MOST:
        raise ExperimentError(
            f"that is a film of {count} pictures, and {MOST} is the most; make it "
            f"faster: --speed {np.ceil(speed * count / MOST):g} (R0842)"
        )
    for now in np.minimum(begin + np.arange(count) * speed / RATE, end):
        picture = ground.copy()
        draw = ImageDraw.Draw(picture)
        for i, (robot, (time, *pose)) in enumerate(zip(robots, drawn, strict=True)):
            colour = COLOURS[i % len(COLOURS)]
            x, y, heading = (float(np.interp(now, time, part)) for part in pose)
            gone = time < now
            trail = np.stack((np.r_[pose[0][gone], x], np.r_[pose[1][gone], y]), axis=1)
            if len(trail) > 1:
                draw.line(view.at(trail), colour, 2 * SMOOTH, joint="curve")
            body = view.at(placed(outline(robot), x, y, heading))
            draw.line([*body, body[0]], colour, 2 * SMOOTH, joint="curve")
            if len(robot.outline):  # an arrow has a tip already
                tip = np.array([[0.0, 0.0], [robot.outline[:, 0].max(), 0.0]])
                draw.line(view.at(placed(tip, x, y, heading)), colour, 2 * SMOOTH)
        draw.text((width - 8 * SMOOTH, 8 * SMOOTH), f"{now:.2f} s", INK, font, "ra")
        yield picture.resize(SIZE, Image.Resampling.BOX)


def _scenery(
    draw: Any, robots: Sequence[Trajectory], view: Stage, title: str, font: Any
) -> None:
    """Draw what does not move: things, walls, names."""
    things = {
        (name, corners.tobytes()): corners
        for robot in robots
        for name, corners in robot.around.items()
        if len(corners) > 2
    }
    for corners in sorted(things.values(), key=lambda c: -float(np.prod(np.ptp(c, 0)))):
        draw.polygon(view.at(corners), FAINT, WALL)
    seen = max(view.size) / view.scale
    for radius in {robot.arena for robot in robots} - {0.0}:
        if radius <= FAR * seen:
            draw.line(view.at(circle(radius)), WALL, 3 * SMOOTH)
    draw.text((8 * SMOOTH, 8 * SMOOTH), title, INK, font)
    for i, robot in enumerate(robots[:NAMED] if len(robots) > 1 else ()):
        place = (8 * SMOOTH, (26 + 16 * i) * SMOOTH)
        draw.text(place, robot.name, COLOURS[i % len(COLOURS)], font)
