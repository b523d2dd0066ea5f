"""Windows' Python under Wine, with rems_net installed by the README's first command."""

from collections.abc import Iterator

import pytest

from tests.windows.wine import Windows, missing, usual


@pytest.fixture(scope="session")
def kept() -> Windows:
    """The system of all sessions, which none of them ends; it is made if it lacks.

    It takes some minutes, 2 GB, and package registries; the folder is kept.
    """
    if why := missing():
        pytest.skip(f"There is no Wine here with what its Python needs; {why}.")
    made = Windows(usual())
    made.make()
    return made


@pytest.fixture(scope="session")
def windows(
    kept: Windows, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Windows]:
    """A system of this session, with rems_net in its Python."""
    with kept.copied(tmp_path_factory.mktemp("wine") / "prefix") as copy:
        yield copy
