"""A file that another program holds for a moment, as a virus scanner does."""

import sys
import threading
from functools import partial
from pathlib import Path

import pytest

from rems_net.system.patience import PATIENCE, patiently


def test_a_refusal_that_lasts_is_raised(tmp_path: Path) -> None:
    tries = []

    def refused() -> None:
        tries.append(1)
        raise PermissionError("it is held")

    with pytest.raises(PermissionError, match="it is held"):
        patiently(refused)
    assert (len(tries) > 1) == (sys.platform == "win32")


@pytest.mark.skipif(sys.platform != "win32", reason="Only Windows holds files so")
def test_a_file_that_is_held_for_a_moment_is_moved(tmp_path: Path) -> None:
    if sys.platform == "win32":
        import _winapi

        path, target = tmp_path / "a.csv", tmp_path / "b.csv"
        path.write_bytes(b"1\n")
        held = _winapi.CreateFile(str(path), 0x80000000, 0, 0, 3, 0, 0)
        timer = threading.Timer(PATIENCE / 2, _winapi.CloseHandle, args=(held,))
        with pytest.raises(PermissionError):
            path.replace(target)
        timer.start()
        patiently(partial(path.replace, target))
        timer.join()
        assert target.read_bytes() == b"1\n"
