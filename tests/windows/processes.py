"""Processes of Windows: which run, and with which environment."""

import sys

if sys.platform == "win32":
    from collections.abc import Iterator
    from contextlib import contextmanager, suppress
    from ctypes import (
        POINTER,
        WinDLL,
        byref,
        c_size_t,
        c_ubyte,
        c_uint64,
        c_void_p,
        create_unicode_buffer,
        sizeof,
    )
    from ctypes.wintypes import BOOL, DWORD, HANDLE

    _LIMITED, _ALL = 0x1000, 0x0410  # query; query and read memory
    _STILL_ACTIVE = 259
    #: bytes from the start of a structure of 64-bit Windows to what it points to
    _PARAMETERS, _ENVIRONMENT, _SIZE = 0x20, 0x80, 0x3F0
    _kernel, _system = WinDLL("kernel32"), WinDLL("ntdll")
    _kernel.OpenProcess.restype = HANDLE
    _kernel.OpenProcess.argtypes = [DWORD, BOOL, DWORD]
    _kernel.CloseHandle.argtypes = [HANDLE]
    _kernel.QueryFullProcessImageNameW.argtypes = [HANDLE, DWORD, c_void_p, c_void_p]
    _kernel.GetExitCodeProcess.argtypes = [HANDLE, POINTER(DWORD)]
    _kernel.ReadProcessMemory.argtypes = [
        HANDLE,
        c_void_p,
        c_void_p,
        c_size_t,
        c_void_p,
    ]
    _system.NtQueryInformationProcess.argtypes = [
        HANDLE,
        DWORD,
        c_void_p,
        DWORD,
        c_void_p,
    ]

    @contextmanager
    def _opened(pid: int, access: int) -> Iterator[int]:
        """Open a process. Raises OSError."""
        handle = _kernel.OpenProcess(access, False, pid)
        if not handle:
            raise OSError(f"there is no process {pid}")
        try:
            yield handle
        finally:
            _kernel.CloseHandle(handle)

    def alive(pid: int) -> bool:
        """Return whether a process runs."""
        status = DWORD()
        try:
            with _opened(pid, _LIMITED) as handle:
                _kernel.GetExitCodeProcess(handle, byref(status))
        except OSError:
            return False
        return status.value == _STILL_ACTIVE

    def pythons() -> list[int]:
        """Return the numbers of all processes that are Python's.

        A console has a process of its own, and `platform` may start cmd.exe.
        """
        pids, count = (DWORD * 4096)(), DWORD()
        _kernel.K32EnumProcesses(pids, sizeof(pids), byref(count))
        found = pids[: count.value // sizeof(DWORD)]
        return [pid for pid in found if _program(pid).endswith("python.exe")]

    def _program(pid: int) -> str:
        """Return the path of a process's program; "" if it is gone."""
        path, size = create_unicode_buffer(1024), DWORD(1024)
        with suppress(OSError), _opened(pid, _LIMITED) as handle:
            _kernel.QueryFullProcessImageNameW(handle, 0, path, byref(size))
        return path.value.lower()

    def environment_of(pid: int) -> str:
        """Return the variables of a process, each with its end of text. Raises OSError.

        They are the ones that it was started with, and the ones that it has set.
        """
        with _opened(pid, _ALL) as handle:

            def read(address: int, count: int) -> bytes:
                data = (c_ubyte * count)()
                if not _kernel.ReadProcessMemory(handle, address, data, count, None):
                    raise OSError(f"process {pid} is gone")
                return bytes(data)

            def word(address: int) -> int:
                return int.from_bytes(read(address, 8), "little")

            basic = (c_uint64 * 6)()
            _system.NtQueryInformationProcess(handle, 0, basic, sizeof(basic), None)
            parameters = word(basic[1] + _PARAMETERS)
            start, size = word(parameters + _ENVIRONMENT), word(parameters + _SIZE)
            return read(start, size).decode("utf-16-le", "replace")
