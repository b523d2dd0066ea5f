"""Leaks: files and sockets that nobody has closed, by what Python says of them."""

import gc
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

_NAME = re.compile(r"name='?([^'>]+)'?")


@contextmanager
def leaks() -> Iterator[list[str]]:
    """A list that has, at the end of the block, what was left open in it and forgotten.

    An object that somebody still holds is not forgotten, and not found.
    """
    found: list[str] = []
    gc.collect()  # what was forgotten before is not of this block
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
