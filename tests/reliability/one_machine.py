"""What befalls one machine: its disk is full, it has few files, its time is set."""

import re
import shutil
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from tests.network.lab import Lab
from tests.reliability.faults import GIVE_UP, TICK, Found, whole
from tests.reliability.rig.programs import until
from tests.reliability.rig.rig import HERE

SETTIME = Path(__file__).parent / "programs" / "settime.c"


def full_disk(folder: Path, on_failure: str, expected: bytes = b"") -> Found:
    """The output's folder on a disk of 64 KB; the run would write more."""
    found = Found(f'a full disk, `on_failure = "{on_failure}"`', "")
    with Lab(folder) as lab:
        _long(lab, f'on_failure = "{on_failure}"\n')
        script = (
            "mkdir -p small && mount -t tmpfs -o size=64k none small && "
            '"$0" -m rems_net run --alone lab.toml --out small/out; status=$?; '
            "mkdir kept; cp -r small/out/. kept; umount small; exit $status"
        )
        run = lab.start("full", ["unshare", "-m", "sh", "-c", script, sys.executable])
        status = run.process.wait(GIVE_UP)
        found.then = "ends" if status else "goes on"
        files = sorted((folder / "kept").glob("*.csv"))
        assert files, run.text()
        found.kept.append(all(whole(path.read_bytes()) for path in files))
        told = run.text().splitlines()
        lines = [x for x in told if "No space left" in x and "output/log: " in x]
        found.said = re.sub(r"/\S*/", "", re.sub(r"^(rems: |\[\S+\] )", "", lines[0]))
    return found


def few_files(folder: Path) -> Found:
    """`ulimit -n 24` for the whole run."""
    found = Found("24 open files at most (`ulimit -n 24`)", "does not start")
    with Lab(folder) as lab:
        _long(lab, "")
        script = 'ulimit -n 24; exec "$0" -m rems_net run --alone lab.toml --out here'
        run = lab.start("few", ["sh", "-c", script, sys.executable])
        status = run.process.wait(GIVE_UP)
        assert status, run.text()
        found.kept.append("Traceback" not in run.text())
        found.said = run.text().strip().splitlines()[-1].removeprefix("rems: ")
    return found


def system_time(folder: Path, seconds: int) -> Found:
    """Set the time of all processes of a run while it runs; nobody decides by it.

    Not that of the machine, which is everybody's: by a library that a C compiler makes.
    """
    where = f"{abs(seconds) // 3600} h {'forward' if seconds > 0 else 'back'}"
    found = Found(f"system time set {where}", "goes on")
    with Lab(folder) as lab:
        lab.file(duration=8)
        lab.says(HERE, "run", "lab.toml", "--alone", "--out", "alone")
        lab.file(duration=8, pace=1)
        library, offset = folder / "settime.so", folder / "offset"
        command = ["cc", "-shared", "-fPIC", "-o", str(library), str(SETTIME)]
        subprocess.run(command, check=True)
        offset.write_bytes(struct.pack("q", 0))
        told = f"LD_PRELOAD={library}", f"SETTIME_FILE={offset}"
        argv = [
            "env",
            *told,
            sys.executable,
            "-m",
            "rems_net",
            "run",
            "--alone",
            "lab.toml",
        ]
        run = lab.start("time", [*argv, "--out", "here"])
        until(lambda: lab.rows() > TICK, f"{TICK} rows", GIVE_UP)
        with offset.open("r+b") as file:
            file.write(struct.pack("q", seconds))
        begun, rows = time.monotonic(), lab.rows()
        asks = [*told, sys.executable, "-c", "import time; print(time.time())"]
        said = subprocess.run(["env", *asks], capture_output=True, check=True).stdout
        assert abs(float(said) - time.time() - seconds) < 60
        until(lambda: lab.rows() > rows, "another row", GIVE_UP)
        found.seconds.append(time.monotonic() - begun)
        assert run.process.wait(GIVE_UP) == 0, run.text()
        found.same.append(lab.digest("here") == lab.digest("alone"))
        found.kept.append(whole((folder / "here/two.csv").read_bytes()))
    return found


def _long(lab: Lab, more: str) -> None:
    lab.file(duration=400)
    file = lab.folder / "lab.toml"
    text = file.read_text("utf-8")
    file.write_text(text.replace("[experiment]\n", f"[experiment]\n{more}"), "utf-8")


#: each with the words by which it is asked for alone
ROWS: list[tuple[str, Callable[[Path], Found]]] = [
    ("a full disk, stop", lambda folder: full_disk(folder, "stop")),
    ("a full disk, drop", lambda folder: full_disk(folder, "drop")),
    ("24 open files", few_files),
    ("system time forward", lambda folder: system_time(folder, 3600)),
    ("system time back", lambda folder: system_time(folder, -3600)),
]


def measure(
    words: Sequence[str], folder: Path, tell: Callable[[str], None]
) -> list[Found]:
    """What happens to one machine alone; with words, the rows that have one of them."""
    found = []
    for i, (title, do) in enumerate(ROWS):
        if words and not any(word in title for word in words):
            continue
        if "time" in title and not shutil.which("cc"):
            tell(f"{title}: left out, since there is no C compiler (cc)")
            continue
        found.append(do(folder / f"one-{i}"))
        tell(" | ".join(found[-1].cells()))
    return found
