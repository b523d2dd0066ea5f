"""The cells of docs/engine.md, in a process that runs cells as a kernel does."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.agents.runs import until
from tests.commands import ROOT
from tests.interrupts import APART, interrupt

PAGE = ROOT / "docs" / "engine.md"
#: It has no file, runs cell after cell in one namespace, and shows the last line.
KERNEL = """
import ast, contextlib, io, json, sys

def run(cell):
    body = ast.parse(cell).body
    last = body.pop() if body and isinstance(body[-1], ast.Expr) else None
    exec(compile(ast.Module(body, []), "<cell>", "exec"), globals())
    if last:
        return eval(compile(ast.Expression(last.value), "<cell>", "eval"), globals())

for line in sys.stdin:
    with contextlib.redirect_stdout(io.StringIO()) as out:
        try:
            shown = run(json.loads(line))
            png = getattr(shown, "_repr_png_", bytes)()[:4].hex()
            answer = {"shown": repr(shown), "png": png}
        except BaseException as error:
            answer = {"error": f"{type(error).__name__}: {error}"}
    print(json.dumps(answer | {"printed": out.getvalue()}), flush=True)
"""


class Kernel:
    """Runs cells; a `%%writefile` is the notebook's own."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.process = subprocess.Popen(
            [sys.executable, "-W", "error", "-c", KERNEL],
            cwd=folder,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            **APART,
        )

    def run(self, cell: str) -> dict[str, str]:
        self.begin(cell)
        return self.end()

    def begin(self, cell: str) -> None:
        assert self.process.stdin is not None
        first, _, rest = cell.partition("\n")
        if first.startswith("%%writefile "):
            (self.folder / first.split()[1]).write_text(rest, encoding="utf-8")
            cell = ""
        self.process.stdin.write(json.dumps(cell) + "\n")
        self.process.stdin.flush()

    def end(self) -> dict[str, str]:
        assert self.process.stdout is not None
        answer: dict[str, str] = json.loads(self.process.stdout.readline())
        return answer


@pytest.fixture
def kernel(tmp_path: Path) -> Iterator[Kernel]:
    here = tmp_path / "notebook"
    here.mkdir()
    made = Kernel(here)
    yield made
    made.process.communicate(timeout=20)


@pytest.fixture
def cells() -> list[str]:
    text = PAGE.read_text(encoding="utf-8")
    return re.findall(r"^```py\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)


def together(cell: str, host: str = "one") -> str:
    """Return the cell with all agents in one process, which starts sooner."""
    agents = r"^( *lab\.(?:input|robot|output)\(.*)\)$"
    return re.sub(agents, rf'\1, host="{host}")', cell, flags=re.MULTILINE)


def undrawn(cell: str) -> str:
    """Return the cell without its picture, which takes a second."""
    return cell.replace("result.plot()", "")


def good(answer: dict[str, str]) -> dict[str, str]:
    assert "error" not in answer, answer
    return answer


def test_the_cells(kernel: Kernel, cells: list[str]) -> None:
    own, run, look = cells
    for cell in (own, run):
        good(kernel.run(cell))
    if not find_spec("matplotlib"):
        look = undrawn(look)
    shown = good(kernel.run(look))
    x, x_unit, *_, far_unit = shown["printed"].split()
    assert (x_unit, far_unit) == ("m", "m")
    if find_spec("matplotlib"):
        assert shown["png"] == b"\x89PNG".hex()
        assert (kernel.folder / "runs/curves/plot.png").exists()
    # What is changed in a cell counts in the next run.
    for cell in (own.replace("0.2,", "0.4,"), together(run)):
        good(kernel.run(cell))
    twice, *_ = good(kernel.run(undrawn(look)))["printed"].split()
    assert float(twice) == pytest.approx(2 * float(x))


def test_a_class_in_a_cell_is_refused(kernel: Kernel, cells: list[str]) -> None:
    own, run, *_ = cells
    for cell in (own, own.partition("\n")[2]):
        good(kernel.run(cell))
    said = kernel.run(run.replace('"cart.py:Curve"', "Curve"))
    assert said["error"] == (
        "ExperimentError: Curve is in no file: it was typed at a prompt or in a cell, "
        "or came with -c or through a pipe, so the process of its agent cannot find "
        "it. Keep it in this program by host='here', or put it into a file, such "
        "as mine.py, and write 'mine.py:Curve'. A cell that begins with %%writefile "
        "mine.py writes that file."
        " (R0427)"
    )


def test_a_class_in_a_cell_runs_in_the_notebook_itself(
    kernel: Kernel, cells: list[str]
) -> None:
    own, run, look = cells
    good(kernel.run(own.partition("\n")[2]))
    run = run.replace('"cart.py:Curve"', "Curve").replace('"cart.py:Cart"', "Cart")
    found = []
    for way in (
        run.replace("lab.run()", "lab.run(direct=True)"),
        together(run, "here"),
    ):
        good(kernel.run(way))
        found.append(good(kernel.run(undrawn(look)))["printed"])
    assert found[0] == found[1]
    assert float(found[0].split()[0]) != 0.0


def test_stopping_a_cell_ends_its_run(kernel: Kernel, cells: list[str]) -> None:
    own, run, *_ = cells
    good(kernel.run(own))
    run = together(run)
    kernel.begin(run.replace("lab.run()", "lab.run(pace=1)"))
    made = kernel.folder / "runs/curves/wide.csv"

    def rows() -> int:
        return (
            len(made.read_text(encoding="utf-8").splitlines()) if made.exists() else 0
        )

    until(lambda: rows() > 3)
    interrupt(kernel.process)
    assert kernel.end()["error"] == "KeyboardInterrupt: "
    stopped = rows()
    assert len({line.count(",") for line in made.read_text().splitlines()}) == 1
    good(kernel.run(run))
    assert 3 < stopped < rows() == 201
