"""Classes that are in no file: agents' processes cannot find them, an engine can."""

import sys
from pathlib import Path

import pytest

from tests.commands import Done, finished

TYPED = """\
from rems_net import Definition, Experiment, In, Out, Schema
from rems_net.defdict import length, velocity
class Cart(Definition):
    command = In(Schema("command", {"speed": velocity(default=1)}))
    state = Out(Schema("state", {"x": length()}))
    def derivative(self, state, command):
        return {"x": command["speed"]}

lab = Experiment("typed", dt="0.1 s", duration="1 s")
lab.robot("cart", Cart, "kinematic")
lab.run(%s)
"""
#: after a file that has a Cart
LATER = """\
class Cart(Cart):
    def derivative(self, state, command):
        return {"x": 0.0}

class Dart(Cart):
    pass

for one in (Cart, Dart):
    lab = Experiment("later", duration="1 s")
    lab.robot("cart", one, "kinematic")
    try:
        lab.run()
    except ValueError as error:
        print(error)

"""


def sentence(name: str) -> str:
    return (
        f"{name} is in no file: it was typed at a prompt or in a cell, or came with "
        "-c or through a pipe, so the process of its agent cannot find it. Keep it in "
        "this program by host='here', or put it into a file, such as mine.py, "
        f"and write 'mine.py:{name}'. A cell that begins with %%writefile mine.py "
        "writes that file. (R0427)"
    )


def python(folder: Path, *words: str, keys: str = "") -> Done:
    return finished([sys.executable, *words], folder, typed=keys)


@pytest.mark.parametrize("way", ["-", "-c", "-i"])
def test_a_class_without_a_file(tmp_path: Path, way: str) -> None:
    """It is refused before anything is made, and runs in the process itself."""
    run, direct = TYPED % "", TYPED % "direct=True" + "print(lab.name, lab.dt)\n"
    for text in (run, direct):
        words = ["-c", text] if way == "-c" else [way]
        done = python(tmp_path, *words, keys="" if way == "-c" else text)
        if text == run:
            assert sentence("Cart") in done.stderr
            assert not (tmp_path / "runs").exists()
        else:
            assert "typed 0.1" in done.stdout, done.stderr


def test_a_class_that_was_typed_after_a_file(tmp_path: Path) -> None:
    """The file's class runs; one that was typed in its place is not taken for it."""
    (tmp_path / "typed_cart.py").write_text(TYPED % "", encoding="utf-8")
    again = "lab.run(out='again')\n"
    done = python(tmp_path, "-i", "typed_cart.py", keys=again + LATER)
    assert (tmp_path / "again").is_dir(), done.stderr
    assert done.stdout.splitlines()[-2:] == [sentence("Cart"), sentence("Dart")]
