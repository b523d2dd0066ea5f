"""Names that every system has: on Windows some are devices, and case tells nothing."""

import re

import pytest

from rems_net import Experiment
from rems_net.errors import ExperimentError
from rems_net.router.keys import is_name


@pytest.mark.parametrize("name", ["con", "NUL", "aux.csv", "Com1", "lpt9.txt", "prn"])
def test_a_device_of_windows_is_no_name(name: str) -> None:
    said = f"the experiment's name is {name!r}, which Windows takes for a device"
    with pytest.raises(ExperimentError, match=re.escape(said)):
        Experiment(name, duration="1 s")


@pytest.mark.parametrize("name", ["con1", "my_con", "com", "nullo", "lpt10x", "a"])
def test_a_name_that_only_begins_like_a_device_is_one(name: str) -> None:
    assert is_name(name)


@pytest.mark.parametrize("name", ["a.", "a:b", "a b", ".a", "a/b", "", "x" * 64])
def test_no_file_of_windows_has_such_a_name(name: str) -> None:
    assert not is_name(name)


def test_two_agents_whose_files_would_be_one() -> None:
    lab = Experiment("lab", duration="1 s")
    lab.robot("sim", "woodbot", "kinematic")
    said = "two agents named robot/sim and robot/Sim; give one another name"
    with pytest.raises(ExperimentError, match=said):
        lab.robot("Sim", "woodbot", "kinematic")
