"""Reader of whole files of a limited size.

A name may be a device that never ends, a pipe that never begins, or a file larger than
the memory. Each raises OSError with its own sentence, so callers report it as they
report any unreadable file.
"""

import errno
import os
import stat
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from pathlib import Path

#: bytes of a table of numbers: a robot at 100 Hz records a tenth of it in a day
TABLE = 2**30
#: bytes of a description: an experiment, a robot, a class
DESCRIPTION = 16 * 2**20
#: bytes of a mesh or a picture; larger ones are not drawn
MESH = 256 * 2**20


def read_file(path: Path, most: int) -> bytes:
    """Return the content of a file of at most `most` bytes.

    Raises OSError for a missing file, for one that is no regular file, for a larger
    one.
    """
    if "\0" in str(path):
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT))
    if path.is_dir():  # or Windows reports that the permission is denied
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    with open(path, "rb", opener=_at_once) as file:
        status = os.fstat(file.fileno())
        if not stat.S_ISREG(status.st_mode):
            raise OSError(
                errno.EINVAL, "it is a device or a pipe; expected a file on a disk"
            )
        # Some files of a system have the size 0, but some content.
        data = b"" if status.st_size > most else file.read(most + 1)
    if max(status.st_size, len(data)) > most:
        raise OSError(
            errno.EFBIG, f"it is too large; expected at most {most // 2**20} MB"
        )
    return data


def decoded(data: bytes) -> str:
    """Return text in UTF-8, or in the UTF-16 that Windows calls "Unicode".

    Raises UnicodeDecodeError.
    """
    marked = data.startswith((BOM_UTF16_LE, BOM_UTF16_BE))
    return data.decode("utf-16" if marked else "utf-8-sig")


def _at_once(path: str, flags: int) -> int:
    """Open a file, without waiting for a writer if it is a pipe."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))
