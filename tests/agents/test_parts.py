"""Parts that installed packages bring: found by name, and what is said when not."""

import os
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from rems_net import Driver, Experiment
from rems_net.agents import parts, registry
from rems_net.errors import ExperimentError, uncoded
from tests.commands import finished

GOOD = """\
from rems_net import Driver, Input


class Lagging(Driver):
    def drive(self, command, dt):
        pass

    def sense(self):
        pass


class Still(Input):
    def read(self, tick):
        return None
"""

Install = Callable[..., Path]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Put a package where Python finds it, as an installer leaves it on the disk."""

    def put(
        name: str,
        points: str,
        modules: Mapping[str, str] | None = None,
        *,
        version: str = "1.0",
        site: str = "site",
    ) -> Path:
        folder = tmp_path / site
        info = folder / f"{name.replace('-', '_')}-{version}.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text(
            f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n"
        )
        (info / "entry_points.txt").write_text(points)
        for module, text in (modules or {}).items():
            monkeypatch.delitem(sys.modules, module, raising=False)
            (folder / f"{module}.py").write_text(text)
        if str(folder) not in sys.path:
            monkeypatch.syspath_prepend(str(folder))
        return folder

    yield put
    for module in [m for m in sys.modules if m.startswith("plug_")]:
        del sys.modules[module]


def refusal(definition: str, driver: str) -> str:
    with pytest.raises(ExperimentError) as caught:
        Experiment().robot("sim", definition, driver)
    return uncoded(caught.value)


def test_found_by_name(install: Install) -> None:
    install(
        "lag-lab", "[rems_net.drivers]\nlag = plug_lag:Lagging\n", {"plug_lag": GOOD}
    )
    lab = Experiment()
    lab.robot("sim", "woodbot", "lag")
    cls = lab.plans["robot/sim"].classes[1]
    assert (cls.__module__, cls.__name__) == ("plug_lag", "Lagging")
    assert issubclass(cls, Driver)
    assert refusal("woodbot", "lagg") == (
        "robot 'sim': There is no driver 'lagg'; there is "
        f"{', '.join(registry.BUILT_IN['driver'])}, lag, or your own as "
        "'my_file.py:MyClass'. Did you mean 'lag'?"
    )


def test_nothing_is_imported_before_it_is_asked_for(install: Install) -> None:
    install("lag-lab", "[rems_net.drivers]\nlag = plug_lag:Lagging\n", {"plug_lag": ""})
    Experiment().robot("sim", "woodbot", "kinematic")
    assert [p.name for p in parts.by_name("driver")["lag"]] == ["lag"]
    assert "plug_lag" not in sys.modules


def test_a_name_of_ours_taken_again(install: Install) -> None:
    install("lag-lab", "[rems_net.drivers]\nkinematic = plug_lag:Lagging\n", {})
    assert refusal("woodbot", "kinematic") == (
        "robot 'sim': There is more than one driver 'kinematic': "
        "'rems_net.drivers.kinematic.kinematic:Kinematic' of rems_net itself and "
        "'plug_lag:Lagging' of lag-lab 1.0. Uninstall one, or write the one you mean "
        "in place of its name."
    )
    lab = Experiment()
    lab.robot("sim", "woodbot", "rems_net.drivers.kinematic.kinematic:Kinematic")
    lab.input("keys", "csv")
    assert set(lab.plans) == {"robot/sim", "input/keys"}


def test_a_name_taken_by_two_packages(install: Install) -> None:
    points = "[rems_net.drivers]\nlag = plug_lag:Lagging\n"
    install("lag-lab", points, {"plug_lag": GOOD})
    install("lag-two", points.replace("plug_lag", "plug_two"), version="2.1")
    assert refusal("woodbot", "lag") == (
        "robot 'sim': There is more than one driver 'lag': 'plug_lag:Lagging' of "
        "lag-lab 1.0 and 'plug_two:Lagging' of lag-two 2.1. Uninstall one, or write "
        "the one you mean in place of its name."
    )


def test_one_name_for_two_kinds(install: Install) -> None:
    install(
        "lag-lab",
        "[rems_net.drivers]\nlag = plug_lag:Lagging\n"
        "[rems_net.inputs]\nlag = plug_lag:Still\n",
        {"plug_lag": GOOD},
    )
    lab = Experiment()
    lab.robot("sim", "woodbot", "lag")
    lab.input("hand", "lag")
    assert lab.plans["input/hand"].classes[0].__name__ == "Still"


BROKEN = [
    (
        "no module",
        "plug_gone:Lagging",
        {},
        "Cannot import 'plug_gone': No module named 'plug_gone'.",
    ),
    (
        "a missing library",
        "plug_lag:Lagging",
        {"plug_lag": "import no_such_library\n"},
        "Cannot import 'plug_lag': No module named 'no_such_library'.",
    ),
    (
        "no class",
        "plug_lag:Laging",
        {"plug_lag": GOOD},
        "plug_lag has no class 'Laging'. Did you mean 'Lagging'?",
    ),
    (
        "no class named",
        "plug_lag",
        {"plug_lag": GOOD},
        "its entry point is 'plug_lag'; expected 'module:Class'.",
    ),
    (
        "of another kind",
        "plug_lag:Still",
        {"plug_lag": GOOD},
        "Still is no driver; expected a subclass of Driver.",
    ),
    (
        "a failure",
        "plug_lag:Lagging",
        {"plug_lag": "def fail():\n    return 1 / 0\n\n\nfail()\n"},
        "ZeroDivisionError: division by zero (plug_lag.py, line 2, in fail)",
    ),
    (
        "no Python",
        "plug_lag:Lagging",
        {"plug_lag": "class Lagging\n"},
        "SITE/plug_lag.py, line 1: expected ':'.",
    ),
    (
        "an exit",
        "plug_lag:Lagging",
        {"plug_lag": "raise SystemExit('enough')\n"},
        "SystemExit: enough (plug_lag.py, line 1, in <module>)",
    ),
    (
        "a script",
        "plug_lag:Lagging",
        {"plug_lag": "from rems_net import Experiment\nExperiment().run()\n"},
        "plug_lag runs an experiment when it is imported; put the line with run() "
        'under `if __name__ == "__main__":`.',
    ),
]


@pytest.mark.parametrize(
    ("point", "modules", "cause"),
    [case[1:] for case in BROKEN],
    ids=[case[0] for case in BROKEN],
)
def test_a_broken_part(
    install: Install, point: str, modules: dict[str, str], cause: str
) -> None:
    site = install("lag-lab", f"[rems_net.drivers]\nlag = {point}\n", modules)
    assert refusal("woodbot", "lag") == (
        "robot 'sim': The driver 'lag' of lag-lab 1.0 cannot be used: "
        f"{cause.replace('SITE/', f'{site}{os.sep}')}"
    )
    Experiment().robot("sim", "woodbot", "kinematic")  # harms nobody else


def test_a_name_that_cannot_be_written(install: Install) -> None:
    install("lag-lab", "[rems_net.drivers]\na:b = plug_lag:Lagging\n", {})
    (part,) = parts.by_name("driver")["a:b"]
    with pytest.raises(ExperimentError) as caught:
        part.load()
    assert uncoded(caught.value) == (
        "The driver 'a:b' of lag-lab 1.0 cannot be used: a name has no ':'."
    )


def test_a_package_that_cannot_be_read(install: Install) -> None:
    site = install("bad", "[rems_net.drivers]\nfast = plug_fast:Fast\n", {})
    (site / "bad-1.0.dist-info" / "entry_points.txt").write_bytes(b"\xff\xfe[rems")
    points = "[rems_net.drivers]\nlag = plug_lag:Lagging\n"
    install("lag-lab", points, {"plug_lag": GOOD})
    Experiment().robot("sim", "woodbot", "lag")
    (sentence,) = parts.brought()[1]
    assert sentence.startswith(f"a package in {site} cannot be read: UnicodeDecode")


def test_the_command_of_rems_net_is_no_part(install: Install) -> None:
    """So an installation without packages of others is not searched in full."""
    site = install("rems-net", "[console_scripts]\nrems = rems_net.cli:main\n", {})
    assert not parts._may_bring(str(site))
    install("lag-lab", "[rems_net.drivers]\nlag = plug_lag:Lagging\n", {})
    assert parts._may_bring(str(site))


def test_a_package_without_a_name(install: Install) -> None:
    site = install("bad", "[rems_net.drivers]\nfast = plug_fast:Fast\n", {})
    (site / "bad-1.0.dist-info" / "METADATA").unlink()
    assert "fast" not in parts.by_name("driver")
    (sentence,) = parts.brought()[1]
    assert sentence.startswith(f"a package in {site} cannot be read: ")


def test_a_version_that_is_hidden_by_another(install: Install) -> None:
    """What is imported counts: the first on the path, as ever in Python."""
    points = "[rems_net.drivers]\nlag = plug_lag:Lagging\n"
    install("lag-lab", f"{points}old = plug_lag:Old\n", {}, version="0.9", site="old")
    install("Lag_Lab", points, {"plug_lag": GOOD}, site="new")
    assert "old" not in parts.by_name("driver")
    (part,) = parts.by_name("driver")["lag"]
    assert part.origin == "Lag_Lab 1.0"


def test_a_type_that_is_no_name() -> None:
    five: Any = 5
    with pytest.raises(ExperimentError) as caught:
        Experiment().process("p", five)
    assert str(caught.value) == (
        "process 'p': process is 5; expected a name, such as "
        f"{next(iter(registry.BUILT_IN['process']))!r}, or a class. (R0426)"
    )


def test_a_host_never_looks_for_names() -> None:
    """It gets module and class; looking costs some milliseconds and is not for it."""
    code = (
        "import sys; from pathlib import Path; import rems_net.agents.host.__main__; "
        "from rems_net.agents import registry; "
        "registry.load('rems_net.drivers.kinematic.kinematic:Kinematic', Path()); "
        "sys.exit('importlib.metadata' in sys.modules)"
    )
    done = finished([sys.executable, "-c", code])
    assert (done.returncode, done.stderr) == (0, "")
