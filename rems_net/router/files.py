"""Open files: a session needs some, and many parts fail if there are too few."""

import os

from rems_net.errors import FabricError

#: files that a session opens, including those that only its start needs
SESSION = 12
#: files per process of a run: two pipes and its link
PROCESS = 3


def check_files(count: int) -> None:
    """Raise FabricError if fewer than `count` more files can be opened.

    It opens them, since no call on all systems returns the limit. Errors of Zenoh, or
    of the import of a module, do not name the cause.
    """
    held: list[int] = []
    try:
        while len(held) < count:
            held.append(os.open(os.devnull, os.O_RDONLY))
    except OSError:
        raise FabricError(
            f"This needs {count} more open files, and the system gives this program "
            f"{len(held)}. Type `ulimit -n 1024` first, in this terminal. (R0614)"
        ) from None
    finally:
        for handle in held:
            os.close(handle)
