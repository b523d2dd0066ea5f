"""One tab for a file of tests, and for each test a page and a robot at its port."""

from collections.abc import Callable, Iterator
from functools import partial

import pytest

from tests.dashboard.browser import Browser, Chromium
from tests.firmware.console.chromium.browser import FAKE, Page
from tests.firmware.console.robot import Robot


@pytest.fixture(scope="module")
def tab(chromium: Chromium) -> Iterator[Browser]:
    with chromium.apart() as made:
        made.send("Runtime.addBinding", name="toTest")
        source = FAKE.read_text(encoding="utf-8")
        made.send("Page.addScriptToEvaluateOnNewDocument", source=source)
        made.size(900, 1200)
        yield made


@pytest.fixture
def show(tab: Browser, robot: Robot) -> Callable[[str], Page]:
    """Open an address, with the robot at the page's port."""
    return partial(Page, tab, robot)
