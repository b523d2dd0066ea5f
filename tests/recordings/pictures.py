"""Draw docs/film.png: a world in 3-D. python -m tests.recordings.pictures"""

import shutil
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory

from rems_net import read
from rems_net.films.space import InSpace
from rems_net.pictures import png
from tests.commands import ROOT, rems

PICTURE = ROOT / "docs" / "film.png"
#: as docs/worlds.md has them
ROWS = "time [s],command/wheel/left [%],command/wheel/right [%]\n3,60,60\n"


def main() -> None:
    with TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "keys.csv").write_text(ROWS, encoding="utf-8")
        shutil.copy(ROOT / "docs" / "programs" / "arena.toml", folder)
        rems(folder, "run", "--direct", "arena.toml")
        with closing(InSpace(read(folder / "runs" / "arena" / "run.mcap"))) as space:
            PICTURE.write_bytes(png(space.picture(space.end)[110:430]))
    print(f"docs/film.png: {PICTURE.stat().st_size / 1000:.1f} kB")


if __name__ == "__main__":
    main()
