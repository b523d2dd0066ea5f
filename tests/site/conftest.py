"""The site, built once for all tests of a session."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.agents.runs import until
from tests.commands import ROOT

#: s. A build takes ten seconds, and longer on a machine that has much to do.
SECONDS = 240


@pytest.fixture(scope="session")
def site(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> Path:
    """The folder of the built site. One of several workers builds it, others wait."""
    pytest.importorskip("furo", reason="the extra `docs` brings furo")
    base = tmp_path_factory.getbasetemp()
    shared = base if worker_id == "master" else base.parent
    folder, log = shared / "site", shared / "site.log"
    words = [sys.executable, "-m", "sphinx", "-W", "-n", "-q", "--keep-going"]
    words += ["-d", str(shared / "doctrees"), "-c", str(ROOT / "docs")]
    try:
        (shared / "site.begun").touch(exist_ok=False)
    except FileExistsError:
        until(log.exists, SECONDS)
    else:
        done = subprocess.run(
            [*words, str(ROOT), str(folder)],
            capture_output=True,
            text=True,
            check=False,
        )
        partly = shared / "site.partly"
        partly.write_text(done.stdout + done.stderr, encoding="utf-8")
        partly.rename(log)
    assert log.read_text(encoding="utf-8") == ""  # no warning, of missing links either
    return folder
