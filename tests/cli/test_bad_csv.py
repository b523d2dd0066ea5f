"""Every mistake in a CSV file to be played is one sentence, by line and column."""

from pathlib import Path

import pytest

from tests.cli.complaint import INPUT, MODEL, complaint

pytestmark = pytest.mark.usefixtures("nothing_starts")

COMMANDS = "expected 'command/<field> [<unit>]', or 'inpt.wh.l' and 'inpt.wh.r'"
LEFT = "command/wheel/left [rad/s]"

CSV = [
    (
        "an empty file",
        None,
        "keys.csv is empty; expected a header such as 'time [s],command/wheel/left "
        "[rad/s],command/wheel/right [rad/s]' in line 1, and one line per step below.",
    ),
    (
        "no rows",
        ("0.5,1.0,2.0\n1.0,3.0,4.0\n", ""),
        "keys.csv has a header and no line below it; expected one line per step.",
    ),
    (
        "text where a number belongs",
        ("3.0", "fast"),
        f"keys.csv, line 3, column '{LEFT}': expected a number in rad/s, but got "
        "'fast'.",
    ),
    (
        "NaN",
        ("3.0", "nan"),
        f"keys.csv, line 3, column '{LEFT}': expected a number in rad/s, but got "
        "'nan'.",
    ),
    (
        "unsorted timestamps",
        ("1.0,3.0", "0.2,3.0"),
        "keys.csv, line 3, column 'time [s]': expected a time after 0.5, which the "
        "line before has, but got '0.2'. Sort the lines by time.",
    ),
    (
        "the same time twice",
        ("1.0,3.0", "0.5,3.0"),
        "keys.csv, line 3, column 'time [s]': expected a time after 0.5, which the "
        "line before has, but got '0.5'.",
    ),
    (
        "a short row",
        (",4.0", ""),
        "keys.csv, line 3: expected 3 cells as in the header, but got 2.",
    ),
    (
        "a decimal comma",
        ("4.0", "4,0"),
        "keys.csv, line 3: expected 3 cells as in the header, but got 4. A decimal "
        "comma? Write points, or put ';' between the cells of all lines.",
    ),
    (
        "no time",
        ("time [s]", "tme [s]"),
        "keys.csv, line 1: expected a column 'time [s]' or 'timestamp', but the "
        f"columns are 'tme [s]', '{LEFT}', 'command/wheel/right [rad/s]'. Did you mean "
        "'time'?",
    ),
    (
        "a misspelt column",
        ("command/wheel/left", "comand/wheel/left"),
        "keys.csv, line 1: there is no column 'comand/wheel/left [rad/s]'; "
        f"{COMMANDS}. Did you mean '{LEFT}'?",
    ),
    (
        "no command",
        ("command", "state"),
        f"keys.csv, line 1: no column is a command; {COMMANDS}, but the columns are "
        "'time [s]', 'state/wheel/left [rad/s]', 'state/wheel/right [rad/s]'.",
    ),
    (
        "an unknown unit",
        ("left [rad/s]", "left [radd]"),
        "keys.csv, line 1, column 'command/wheel/left [radd]': 'radd' is not a "
        "unit that unyt knows. Did you mean 'rad'?",
    ),
    (
        "a time in metres",
        ("time [s]", "time [m]"),
        "keys.csv, line 1, column 'time [m]': expected a time, such as 'time [s]', but "
        "'m' is no unit of time.",
    ),
    (
        "beyond full speed",
        ("left [rad/s]", "left [percent]", "3.0", "300"),
        "keys.csv, line 3, column 'command/wheel/left [percent]': expected a number in "
        "percent from -100 to 100, but got '300'.",
    ),
]


@pytest.mark.parametrize(
    ("edit", "sentence"), [case[1:] for case in CSV], ids=[case[0] for case in CSV]
)
def test_in_the_csv_file(
    folder: Path,
    capsys: pytest.CaptureFixture[str],
    edit: tuple[str, ...] | None,
    sentence: str,
) -> None:
    path = folder / "keys.csv"
    text = path.read_text() if edit else ""
    for old, new in zip((edit or ())[::2], (edit or ())[1::2], strict=True):
        text = text.replace(old, new)
    path.write_text(text)
    assert complaint(capsys, "run", "lab.toml") == INPUT + sentence


def test_nothing_gives_a_field(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What helps in TOML, and no word of Python."""
    path = folder / "keys.csv"
    path.write_text(path.read_text().replace("command/wheel/left", "state/left"))
    assert complaint(capsys, "run", "lab.toml") == (
        f"{MODEL}input/keys/value (keys.value) cannot become robot/model/command "
        "(woodbot.command):\n  - nothing gives 'wheel/left' (rad/s -7.3..7.3). Connect "
        "what has it, or a process that makes it."
    )


def test_a_column_of_the_wrong_dimension(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = folder / "keys.csv"
    path.write_text(path.read_text().replace("left [rad/s]", "left [m]"))
    assert complaint(capsys, "run", "lab.toml") == (
        f"{MODEL}input/keys/value (keys.value) cannot become robot/model/command "
        "(woodbot.command):\n  - 'wheel/left': m (length) cannot become rad/s (angular "
        "velocity)."
    )
