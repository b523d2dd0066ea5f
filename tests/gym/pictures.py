"""Draw docs/train.png: the paths of examples/train.py. python -m tests.gym.pictures"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from tests.commands import ROOT, python

PICTURE = ROOT / "docs" / "train.png"
#: Matplotlib reads it in the working folder
STYLE = """
figure.figsize: 4.6, 3.4
figure.constrained_layout.use: True
savefig.dpi: 110
font.size: 8
axes.grid: True
grid.color: 0.92
axes.spines.top: False
axes.spines.right: False
legend.frameon: False
"""


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "matplotlibrc").write_text(STYLE, encoding="utf-8")
        shutil.copy(ROOT / "examples" / "train.py", folder)
        print(python(folder, "train.py").stdout)
        shutil.copy(folder / "paths.png", PICTURE)
    print(f"docs/train.png: {PICTURE.stat().st_size / 1000:.1f} kB")


if __name__ == "__main__":
    main()
