"""Windows' Python under Wine, with rems_net installed by the README's first command."""

import pytest

from tests.windows.wine import Windows, missing, usual


@pytest.fixture(scope="session")
def windows() -> Windows:
    """The system, with rems_net in its Python; it is made where it is not there yet.

    It takes some minutes, 2 GB, and package registries; the folder is kept.
    """
    if why := missing():
        pytest.skip(f"There is no Wine here with what its Python needs; {why}.")
    made = Windows(usual())
    made.make()
    return made
