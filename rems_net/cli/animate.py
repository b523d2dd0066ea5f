"""`rems animate DIR`: a film of a run that is over, from above or in 3-D."""

import argparse
from contextlib import closing
from pathlib import Path

from rems_net.cli.options import add_like, add_run, console, recording_of, writing
from rems_net.errors import ExperimentError, shown

EXAMPLES = """\
examples:
  rems animate                          the newest run, as an animated PNG
  rems animate runs/lab/run.mcap --speed 4
  rems animate runs/lab --out lab.gif   or .webp, or .mp4 where ffmpeg is
  rems animate runs/lab --3d            bodies in their arena, by MuJoCo
"""


def add(parser: argparse.ArgumentParser) -> None:
    add_run(parser)
    add_like(parser)
    parser.add_argument(
        "--speed", metavar="X", type=float, default=1.0, help="times as fast (1)"
    )
    parser.add_argument(
        "--3d", dest="space", action="store_true", help="in 3-D (from above)"
    )
    parser.add_argument(
        "--out",
        metavar="FILE",
        type=Path,
        help=".png, .gif, .webp or .mp4 (DIR/film.png)",
    )


def run(args: argparse.Namespace) -> int:
    """Draw the film, and print its path."""
    from rems_net.recordings.animation.film import FromAbove, film

    recording = recording_of(args)
    path = (args.out or recording.folder / "film.png").absolute()
    if not 0 < args.speed < 1e6:
        raise ExperimentError(
            f"--speed is {args.speed:g}; expected a number above 0, such as 4. (R0842)"
        )
    about = recording.folder.name, path, args.speed
    # the status is shown on a terminal only
    with writing(path), console(args).status("film") as status:
        if args.space:
            from rems_net.films.space import InSpace

            with closing(InSpace(recording)) as space:
                film(space, *about, status.update)
        else:
            film(FromAbove(recording.trajectories()), *about, status.update)
    print(f"film  {shown(path)}")
    return 0
