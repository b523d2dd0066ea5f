"""What every test gets: a fabric of its own, that no other test can find."""

import compileall
import gc
import os
import sys
from collections import Counter
from collections.abc import Iterator
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import settings

if TYPE_CHECKING:
    from tests.dashboard.browser import Chromium

ROOT = Path(__file__).parents[1]

# The threads that numpy's library starts wait in a loop: they take half of the
# processor time of `import numpy`, and the tests start thousands of processes. The
# matrices of the tests need no threads.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# An example may take long on a busy machine: time is what benchmarks are for.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")


def pytest_configure(config: pytest.Config) -> None:
    """Compile what hundreds of processes will import, before any of them starts.

    Else each does so for itself where PYTHONDONTWRITEBYTECODE is set, as in containers.
    """
    if not hasattr(config, "workerinput"):
        for folder in ("rems_net", "tests"):
            compileall.compile_dir(ROOT / folder, quiet=1)


@pytest.fixture(autouse=True)
def places() -> Iterator[None]:
    """Forget the files that a test loads, and their folders.

    A later test could import from these, and its workers load all loaded files.
    """
    path, here, known = sys.path[:], Path.cwd(), set(sys.modules)
    yield
    for name in sys.modules.keys() - known:
        if name.startswith("rems_script:"):
            del sys.modules[name]
    sys.path[:] = path
    os.chdir(here)


def pytest_collection_finish() -> None:
    """Let no later garbage collection look at what is there for the whole session."""
    gc.collect()
    gc.freeze()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Two more than there are cores: most tests wait for what they have started."""
    return (os.cpu_count() or 1) + 2


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """List why tests were skipped."""
    reasons = _skipped(terminalreporter)
    if reasons:
        terminalreporter.section("skipped")
    for reason, count in reasons.most_common():
        terminalreporter.line(f"{count:4} {reason}")


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    """Fail where CI is set, if a test was skipped for a reason that is on no list."""
    reporter: Any = session.config.pluginmanager.get_plugin("terminalreporter")
    if not os.environ.get("CI") or hasattr(session.config, "workerinput"):
        return
    known = (ROOT / "tests" / "skips.txt").read_text(encoding="utf-8").splitlines()
    for reason in _skipped(reporter):
        if not any(fnmatchcase(reason, line) for line in known):
            reporter.line(f"\nA skip that is not in tests/skips.txt: {reason}")
            session.exitstatus = pytest.ExitCode.TESTS_FAILED


def _skipped(reporter: Any) -> Counter[str]:
    """Return how many tests were skipped for each reason."""
    reports = reporter.stats.get("skipped", ())
    return Counter(
        report.longrepr[2].removeprefix("Skipped: ").splitlines()[0]
        for report in reports
        if isinstance(report.longrepr, tuple)
    )


@pytest.fixture(scope="session")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> "Iterator[Chromium]":
    """The browser of this process: a start takes a second. Open tabs with `apart`."""
    from tests.dashboard.browser import started

    with started(tmp_path_factory.mktemp("chromium")) as made:
        yield made


@pytest.fixture(autouse=True)
def own_fabric(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Routers leave their notes in a folder of this test only."""
    folder = tmp_path / "runtime"
    folder.mkdir()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(folder))
    # ...and what a user has joined is forgotten; Windows and macOS look elsewhere
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("APPDATA", str(tmp_path / "config"))
    monkeypatch.delenv("REMS_ROUTER", raising=False)
