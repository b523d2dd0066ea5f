"""Open files: a session needs some, and where there are too few, much fails at once."""

import os

from rems_net.errors import FabricError

#: what a session opens, with what starting it takes for a moment
SESSION = 12
#: what each process that a run starts needs here: two pipes, and its link
PROCESS = 3


def check_files(count: int) -> None:
    """Raise FabricError unless so many more files can be open at once.

    Tried out, since no system-independent call tells the limit. Neither Zenoh nor the
    import of a module says it well when they come upon it.
    """
    held: list[int] = []
    try:
        while len(held) < count:
            held.append(os.open(os.devnull, os.O_RDONLY))
    except OSError:
        raise FabricError(
            f"This needs {count} more open files, and the system gives this program "
            f"{len(held)}. Type `ulimit -n 1024` first, in this terminal."
        ) from None
    finally:
        for handle in held:
            os.close(handle)
