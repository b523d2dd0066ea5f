"""A Python for another architecture: `python -m tests.maths.emulate FOLDER`.

On Debian: takes qemu's user-mode emulator, Debian's Python for arm64 and three
wheels for it, unpacks them in FOLDER (300 MB), installs nothing, and says what to type.
"""

import re
import subprocess
import sys
import zipfile
from importlib.metadata import version
from pathlib import Path

LIBRARIES = (
    *("libc6", "libgcc-s1", "libstdc++6", "zlib1g", "libexpat1", "libssl3"),
    *("libffi8", "libbz2-1.0", "liblzma5", "libsqlite3-0", "libuuid1"),
)
WHEELS = ("numpy", "msgpack", "eclipse-zenoh")


def do(folder: Path, *command: str) -> str:
    done = subprocess.run(
        command, cwd=folder, stdout=subprocess.PIPE, text=True, check=True
    )
    return done.stdout


def main(folder: Path) -> None:
    for name in ("lists/partial", "cache/archives/partial", "debs", "wheels", "root"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    (folder / "status").touch()
    debs, root = folder / "debs", folder / "root"
    do(debs, "apt-get", "download", "qemu-user-static")
    (qemu,) = debs.glob("qemu-user-static*.deb")
    do(folder, "dpkg", "-x", str(qemu.rename(folder / "qemu.deb")), "qemu")
    found = re.search(
        r"Depends: python(3\.\d+)", do(folder, "apt-cache", "depends", "python3")
    )
    assert found is not None
    python = found[1]
    arm64 = [
        *("-o", "APT::Architecture=arm64", "-o", "APT::Architectures::=arm64"),
        *("-o", f"Dir::State={folder}", "-o", f"Dir::State::status={folder}/status"),
        *("-o", f"Dir::Cache={folder}/cache"),
    ]
    do(debs, "apt-get", *arm64, "update")
    parts = [f"python{python}-minimal"]
    parts += [f"libpython{python}-{part}" for part in ("minimal", "stdlib")]
    do(debs, "apt-get", *arm64, "download", *parts, *LIBRARIES)
    for deb in debs.glob("*.deb"):
        do(folder, "dpkg", "-x", str(deb), str(root))
    site = root / "usr/lib/python3/dist-packages"
    kinds = [f"manylinux{k}_aarch64" for k in ("2014", "_2_17", "_2_27", "_2_28")]
    do(
        folder,
        *(sys.executable, "-m", "pip", "download", "--no-deps", "--dest", "wheels"),
        *("--only-binary=:all:", "--python-version", python),
        *(word for kind in kinds for word in ("--platform", kind)),
        *(f"{name}=={version(name)}" for name in WHEELS),
    )
    for wheel in (folder / "wheels").glob("*.whl"):
        zipfile.ZipFile(wheel).extractall(site)
    emulator = folder / "qemu/usr/bin/qemu-aarch64-static"
    command = f"{emulator} -L {root} {root}/usr/bin/python{python}"
    print(f"export REMS_OTHER_PYTHON='{command}'")


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve())
