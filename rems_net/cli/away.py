"""What is said first where a command goes to another machine."""

from __future__ import annotations

import os

from rems_net.cli.words import warn
from rems_net.router.find import VARIABLE, chosen
from rems_net.router.finding.address import is_here


def say_where(at: str) -> None:
    """Say at which other machine the router is, if it is at one."""
    if (there := chosen(at)) and not is_here(there):
        why = f"{VARIABLE} says so" if os.environ.get(VARIABLE) else "see `rems leave`"
        why = "--at says so" if at else why
        warn(f"at {there} ({why})")
