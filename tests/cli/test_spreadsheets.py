"""Files as Windows and spreadsheets make them: read where it is safe, else named."""

from pathlib import Path

import pytest

from rems_net.errors import ExperimentError
from rems_net.inputs.csv import CsvInput
from rems_net.recordings.csv_file import Cell
from tests.cli.conftest import KEYS, LAB
from tests.commands import Run

PLAIN = "time [s],command/left [rad/s],command/right [rad/s]\n0.5,1.5,2\n1,-3.25,1e2\n"


def played(folder: Path, data: bytes) -> list[tuple[Cell, ...]]:
    (folder / "keys.csv").write_bytes(data)
    made = CsvInput("keys", options={"file": "keys.csv"}, folder=folder)
    made.prepare()
    return [(t, *cells) for t, cells in zip(made._times, made._cells, strict=True)]


@pytest.mark.parametrize(
    "data",
    [
        PLAIN.encode("utf-8-sig"),
        PLAIN.encode("utf-16"),
        PLAIN.replace(",", "\t").replace("\n", "\r\n").encode("utf-16"),
        b"\xfe\xff" + PLAIN.encode("utf-16-be"),
        PLAIN.replace(",", "\t").encode(),
        PLAIN.replace(",", ";").encode(),
        PLAIN.replace(",", ";").replace(".", ",").encode("utf-8-sig"),
        PLAIN.replace(",", "\t").replace(".", ",").encode("utf-16"),
        PLAIN.replace("1.5", '"1,5"')
        .replace("-3.25", '"-3,25"')
        .replace("0.5", '"0,5"')
        .encode(),
        PLAIN.replace("\n", ",,\n").encode() + b",,,,\n,,,,\n",
        PLAIN.encode() + b",,\n",
        PLAIN.replace("0.5,1.5,2", "0.5,1.5,2,").encode(),
        (PLAIN.replace("\n", ",\n").replace(",", ";") + ";;;\n").encode(),
        PLAIN.replace("\n", "\r").encode(),
    ],
    ids=[
        "byte-order mark",
        "utf-16",
        "Unicode text of Excel",
        "big-endian",
        "tabs",
        "semicolons",
        "decimal commas",
        "tabs and decimal commas",
        "decimal commas in quotes",
        "empty cells at the end of all",
        "an empty last line",
        "an empty cell at the end of one",
        "empty cells and semicolons",
        "lines as they once were",
    ],
)
def test_what_is_read(tmp_path: Path, data: bytes) -> None:
    assert played(tmp_path, data) == [(0.5, 1.5, 2.0), (1.0, -3.25, 100.0)]


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (
            b"PK\x03\x04\x14\x00\x06\x00",
            "keys.csv is a workbook (.xlsx or .ods), in spite of its name; open it "
            "in a spreadsheet program, and save it as 'CSV UTF-8'.",
        ),
        (
            b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1",
            "keys.csv is a workbook (.xls), in spite of its name; open it in a "
            "spreadsheet program, and save it as 'CSV UTF-8'.",
        ),
        (
            PLAIN.encode("utf-16-le"),
            "keys.csv is no text in UTF-8; save it as 'CSV UTF-8'.",
        ),
        (
            PLAIN.replace(",", "\t").replace("0.5", "1,234").replace(".5", "").encode(),
            "keys.csv has '1,234' in line 2 and '-3.25' in line 3; expected a point "
            "in both, as in 0.5.",
        ),
        (
            b"time [s]\tcommand/left [rad/s]\n1\t1,234\n2\t2,500\n",
            "keys.csv, line 2: '1,234' can be 1.234 or 1234; write it with a point, or "
            "without the comma.",
        ),
        (
            b"time [s],command/left [rad/s]\n0,5,1,5\n",
            "keys.csv, line 2: expected 2 cells as in the header, but got 4. A decimal "
            "comma? Write points, or put ';' between the cells of all lines.",
        ),
        (
            b"time [s];command/left [rad/s]\n0,5;\n",
            "keys.csv, line 2, column 'command/left [rad/s]': expected a number in "
            "rad/s, but got ''.",
        ),
        (
            b"time [s];command/left [rad/s]\n0,5;1,5\n\n1;x\n",
            "keys.csv, line 4, column 'command/left [rad/s]': expected a number in "
            "rad/s, but got 'x'.",
        ),
    ],
    ids=[
        "xlsx",
        "xls",
        "utf-16 without a mark",
        "commas and points",
        "a thousand or one",
        "decimal commas between commas",
        "an empty cell",
        "the line is that of the file",
    ],
)
def test_what_is_named(tmp_path: Path, data: bytes, sentence: str) -> None:
    with pytest.raises(ExperimentError) as caught:
        played(tmp_path, data)
    assert str(caught.value) == f"{sentence} (R0804)"


def test_words_keep_their_commas(tmp_path: Path) -> None:
    text = "time [s];command/say [text];command/left [rad/s]\n0,5;1,5;2,5\n"
    assert played(tmp_path, text.encode()) == [(0.5, "1,5", 2.5)]


@pytest.mark.parametrize("code", ["utf-8-sig", "utf-16"])
def test_an_experiment_from_notepad(rems: Run, folder: Path, code: str) -> None:
    (folder / "lab.toml").write_bytes(LAB.replace("\n", "\r\n").encode(code))
    (folder / "keys.csv").write_bytes(KEYS.replace("\n", "\r\n").encode(code))
    done = rems("run", "--direct", "lab.toml")
    assert (done.returncode, done.stderr) == (0, "")
    assert (folder / "runs/lab/model.csv").is_file()


HINT = (
    " Is it a path? Write it in single quotes, 'data\\keys.csv', or with slashes, "
    '"data/keys.csv".'
)


@pytest.mark.parametrize(
    ("path", "sentence"),
    [
        (
            r'"lab\keys.csv"',
            "lab.toml, line 9, column 22: this is no TOML: Unescaped '\\' in a "
            f"string.{HINT} (R0403)",
        ),
        (
            r'"C:\Users\me\keys.csv"',
            f"lab.toml, line 9, column 21: this is no TOML: Invalid hex value.{HINT} "
            "(R0403)",
        ),
        (
            r'"data\new.csv"',
            'lab.toml, [[input]] "keys": there is no file '
            r"'data\new.csv': in double quotes a backslash is the beginning of another "
            "character. Write the path in single quotes, or with slashes. (R0804)",
        ),
    ],
)
def test_backslashes_in_a_path(
    rems: Run, folder: Path, path: str, sentence: str
) -> None:
    text = LAB.replace('"keys.csv"', path)
    (folder / "lab.toml").write_text(text)
    done = rems("check", "lab.toml")
    assert (done.returncode, done.stderr.strip()) == (2, f"rems: {sentence}")
