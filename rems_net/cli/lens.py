"""`rems lens FOLDER --board 9x6`: the lens of a camera, from pictures of a board."""

import argparse
import re
from pathlib import Path

from rems_net.errors import ExperimentError
from rems_net.eyes.opencv import grey_file, lens_of_board

EXAMPLES = """\
examples:
  rems lens runs/eyes/cam.picture --board 9x6    9 by 6 inner corners

It prints the line of parameters for the experiment's file. Ten pictures of a
chessboard from several sides are enough; an output of type pictures keeps those
of a webcam.
"""
#: inner corners of a board, each way, that OpenCV can find
FEWEST = 3
#: endings of files that are read
PICTURES = {".png", ".jpg", ".jpeg", ".bmp"}


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", metavar="FOLDER", type=Path, help="of the pictures")
    parser.add_argument(
        "--board", metavar="COLUMNSxROWS", default="9x6", help="inner corners (9x6)"
    )


def run(args: argparse.Namespace) -> int:
    """Print the lens, and how well the pictures fit it."""
    match = re.fullmatch(r"(\d{1,2})x(\d{1,2})", args.board)
    if match is None or min(map(int, match.groups())) < FEWEST:
        raise ExperimentError(
            f"--board is {args.board!r}; write the board's inner corners, one less "
            f"than its squares each way, {FEWEST} at least, such as 9x6. (R1107)"
        )
    files = args.folder.glob("*") if args.folder.is_dir() else ()
    named = [path for path in sorted(files) if path.suffix.lower() in PICTURES]
    read = [grey for path in named if (grey := grey_file(path)) is not None]
    if not read:
        raise ExperimentError(
            f"there are no pictures in {args.folder}; name a folder with files such as "
            "1.png. (R1107)"
        )
    if len({grey.shape for grey in read}) > 1:
        raise ExperimentError(
            f"the pictures in {args.folder} have several sizes; a lens is of one: take "
            "all with the same camera and size. (R1107)"
        )
    lens, left = lens_of_board(read, int(match[1]), int(match[2]))
    bends = ", ".join(f"{one:.5f}" for one in lens.bends)
    print(
        f"parameters = {{ width = {lens.width}, height = {lens.height}, "
        f"fx = {lens.fx:.2f}, fy = {lens.fy:.2f}, cx = {lens.cx:.2f}, "
        f"cy = {lens.cy:.2f}, bends = [{bends}] }}"
    )
    print(f"# {len(read)} pictures; corners deviate by {left:.2f} pixels")
    return 0
