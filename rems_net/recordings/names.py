"""Names of robots, and of the folders of runs."""

import re
from pathlib import Path

from rems_net.errors import nearest


def near(path: Path) -> str:
    """Return a hint at a folder of a run: that of this file, or one of such a name."""
    if path.is_file() and path.suffix == ".csv":
        return f" Did you mean {path.parent.as_posix()!r}?"
    runs = path.parent, path.parent / "runs"
    here = {one.name: one for some in runs for one in some.glob("*") if one.is_dir()}
    found = nearest(path.stem, here)
    return next(
        (found.replace(n, here[n].as_posix()) for n in here if f"'{n}'" in found), ""
    )


def natural(path: Path | str) -> list[tuple[int, int, str]]:
    """Return a key to sort names by, in which r2 comes before r10."""
    name = path.stem if isinstance(path, Path) else path
    parts = re.split(r"(\d+)", name)
    return [(1, int(p), "") if p.isdecimal() else (0, 0, p) for p in parts if p]
