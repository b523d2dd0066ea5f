"""One browser for a session, and for each test a page and a robot at its port."""

from collections.abc import Callable, Iterator

import pytest

from tests.firmware.console.chromium.browser import Browser, Page
from tests.firmware.console.robot import Robot


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    made = Browser(tmp_path_factory.mktemp("browser"))
    try:
        yield made
    finally:
        made.close()


@pytest.fixture
def show(browser: Browser, robot: Robot) -> Iterator[Callable[[str], Page]]:
    """Open an address, with the robot at the page's port."""
    pages: list[Page] = []

    def opened(address: str) -> Page:
        pages.append(Page(browser, robot, address))
        return pages[-1]

    try:
        yield opened
    finally:
        for page in pages:
            page.close()
