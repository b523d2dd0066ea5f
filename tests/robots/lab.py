"""The class's recordings, where they are: beside the repository, in shared/data."""

import csv
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDER = ROOT.parent / "shared" / "data" / "woodbot-lab"

Row = dict[str, float]


def recording(name: str) -> list[Row]:
    """Return the rows of a recording; skip the test where it is not there."""
    path = FOLDER / name
    if not path.exists():
        pytest.skip(
            f"The class's recording {name} is not in ../shared/data/woodbot-lab: "
            "it is not part of the project."
        )
    with path.open(newline="") as file:
        return [
            {column: float(text) for column, text in row.items()}
            for row in csv.DictReader(file)
        ]


def models() -> list[str]:
    """Return the names of the recordings of the class's own kinematic model."""
    return sorted(path.name for path in FOLDER.glob("Model*.csv")) or ["Model*.csv"]
