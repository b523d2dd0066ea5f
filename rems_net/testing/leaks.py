"""Leaks: files and sockets that were left open, found by Python's own warnings."""

import gc
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

_NAME = re.compile(r"name='?([^'>]+)'?")


@contextmanager
def leaks() -> Iterator[list[str]]:
    """Yield a list; at the end of the block it has what was left open and forgotten.

    An object that still has a reference is not forgotten, and not found.
    """
    found: list[str] = []
    gc.collect()  # objects forgotten before do not count
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", ResourceWarning)
        yield found
        gc.collect()
    for one in told:
        if issubclass(one.category, ResourceWarning):
            said = str(one.message)
            name = _NAME.search(said)
            found.append(f"a file, {name[1]}" if name else said)
