"""Tables as spreadsheets save them, converted to our CSV format.

Excel writes UTF-16 with tabs, or semicolons and decimal commas, and empty cells behind
the last column, by its settings and the language of the system. A table with one
possible reading is read; any other is refused.
"""

import codecs
import csv
import io
import re

from rems_net.errors import ExperimentError

#: first bytes of files that are not text
BINARY = {
    b"PK\x03\x04": "a workbook (.xlsx or .ods)",
    b"\xd0\xcf\x11\xe0": "a workbook (.xls)",
}
_UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_COMMA = re.compile(r"\s*[-+]?\d*,\d+([eE][-+]?\d+)?\s*")
_POINT = re.compile(r"\s*[-+]?\d*\.\d+([eE][-+]?\d+)?\s*")
#: 1,234 is more than a thousand in English, and little more than one elsewhere
_EITHER = re.compile(r"\s*[-+]?[1-9]\d{0,2},\d{3}\s*")
#: a line that ends with an empty cell, or a number with a comma in quotes
_ODD = re.compile(r'[,;\t][ \t]*$|"[-+]?\d*,\d+"', re.MULTILINE)


def plain(data: bytes, shown: str) -> str:
    """Return the text of a file, with commas between cells and decimal points.

    shown: its name in messages. Raises ExperimentError if it is not text, or if its
    numbers can be read in two ways.
    """
    text = decoded(data, shown)
    head = text.partition("\n")[0]
    mark = next((m for m in ";\t" if m in head and "," not in head), ",")
    if mark == "," and not _ODD.search(text):
        return text
    try:
        lines = text.splitlines(keepends=True)
        rows = list(csv.reader(lines, delimiter=mark, strict=True))
    except csv.Error:
        return text  # the reader of the text reports the line
    header = _without_end(rows[0], 0) if rows else []
    words = {i for i, h in enumerate(header) if h.endswith("[text]")}
    words |= {len(header) - 1} if header[-1:] and "comment" in header[-1] else set()
    written = io.StringIO()
    writer = csv.writer(written, lineterminator="\n")
    writer.writerow(header)
    commas = _decimal_commas(rows[1:], words, mark, shown)
    for row in rows[1:]:
        if commas:
            for i, cell in enumerate(row):
                if i not in words and _COMMA.fullmatch(cell):
                    row[i] = cell.replace(",", ".")
        empty = not "".join(row).strip()
        writer.writerow([] if empty else _without_end(row, len(header)))
    return written.getvalue()


def decoded(data: bytes, shown: str) -> str:
    """Return the text of a file in UTF-8 or UTF-16. Raises ExperimentError."""
    for beginning, what in BINARY.items():
        if data.startswith(beginning):
            raise ExperimentError(
                f"{shown} is {what}, in spite of its name; open it in a spreadsheet "
                "program, and save it as 'CSV UTF-8'. (R0804)"
            )
    if data.startswith(_UTF_16):
        code = "utf-16"
    elif b"\0" in data[:1024]:
        raise ExperimentError(
            f"{shown} is no text in UTF-8; save it as 'CSV UTF-8'. (R0804)"
        )
    else:
        code = "utf-8-sig"
    # An odd character in a comment is no reason to refuse the numbers.
    text = data.decode(code, errors="replace")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _without_end(row: list[str], count: int) -> list[str]:
    """Return a row without the empty cells behind the first `count`."""
    row = [*row]
    while len(row) > count and not row[-1].strip():
        row.pop()
    return row


def _decimal_commas(
    rows: list[list[str]], words: set[int], mark: str, shown: str
) -> bool:
    """Return whether numbers have decimal commas. Raises ExperimentError if unclear."""
    places = [
        (line, cell)
        for line, row in enumerate(rows, 2)
        for i, cell in enumerate(row)
        if i not in words
    ]
    commas = [(line, cell) for line, cell in places if _COMMA.fullmatch(cell)]
    if not commas:
        return False
    points = [(line, cell) for line, cell in places if _POINT.fullmatch(cell)]
    if points:
        (line, comma), (other, point) = commas[0], points[0]
        raise ExperimentError(
            f"{shown} has {comma.strip()!r} in line {line} and {point.strip()!r} in "
            f"line {other}; expected a point in both, as in 0.5. (R0804)"
        )
    if mark != ";" and all(_EITHER.fullmatch(cell) for _, cell in commas):
        line, cell = commas[0]
        raise ExperimentError(
            f"{shown}, line {line}: {cell.strip()!r} can be "
            f"{cell.strip().replace(',', '.')} or {cell.strip().replace(',', '')}; "
            "write it with a point, or without the comma. (R0804)"
        )
    return True
