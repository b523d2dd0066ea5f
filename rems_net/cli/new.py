"""`rems new KIND NAME`: a short file to begin with, which runs at once."""

import argparse
import keyword
import re
import sys
from importlib.machinery import PathFinder
from pathlib import Path
from string import Template

import rems_net
from rems_net.bodies.files.draft import drafted
from rems_net.cli.options import console, writing
from rems_net.errors import ExperimentError, nearest

EXAMPLES = """\
examples:
  rems new robot my_robot             writes my_robot.py
  rems new robot my_arm --from arm.urdf
                                      writes my_arm.py, for the robot in that
                                      file, which is a URDF or an MJCF
  rems new experiment lab             writes lab.toml, and lab.csv for its input

Nothing is ever overwritten.
"""
FOLDER = Path(rems_net.__file__).parent / "templates"
#: kind -> endings of the files that are written
KINDS = {
    **dict.fromkeys(("robot", "driver", "input", "process", "output"), (".py",)),
    "experiment": (".toml", ".csv"),
}

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,39}")


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("kind", metavar="KIND", help=", ".join(KINDS))
    parser.add_argument("name", metavar="NAME", help="such as my_robot")
    parser.add_argument(
        "--from",
        dest="file",
        metavar="FILE",
        help="of a robot: the URDF or MJCF that describes it",
    )
    parser.add_argument(
        "--root",
        default="",
        metavar="BODY",
        help="which body of an MJCF is the robot, if it has several",
    )
    parser.add_argument(
        "--packages",
        default="",
        metavar="FOLDER",
        help="what package:// means in a URDF, if it is not found",
    )


def run(args: argparse.Namespace) -> int:
    """Write the files, and print what to type next."""
    kind, name = args.kind, args.name
    if kind not in KINDS:
        raise ExperimentError(
            f"There is no kind {kind!r}; expected one of {', '.join(KINDS)}."
            f"{nearest(kind, KINDS)} (R0906)"
        )
    more: dict[str, str] = {}
    source = kind
    if args.file is not None:
        if kind != "robot":
            raise ExperimentError(
                f"--from is the file of a robot; type: rems new robot {name} --from "
                f"{args.file} (R0904)"
            )
        more, source = drafted(Path(args.file), args.packages, args.root), "model"
    texts = {Path(f"{name}{end}"): template(source, end) for end in KINDS[kind]}
    check(kind, name, "".join(texts.values()))
    for path in texts:
        if path.exists():
            raise ExperimentError(
                f"There is a file {path} here already, and it stays as it is; choose "
                "another name. (R0907)"
            )
    words = more | {"name": name, "Class": class_name(name)}
    for path, text in texts.items():
        with writing(path), path.open("x", encoding="utf-8", newline="\n") as file:
            file.write(Template(text).substitute(words))
    first = next(iter(texts))
    out = console(args)
    wrote = f"Wrote {' and '.join(map(str, texts))}."
    if guesses := more.get("guesses"):
        out.print(f"{wrote} These are guesses:", soft_wrap=True)
        for guess in guesses.splitlines():
            out.print(f"  {guess}", soft_wrap=True)
        wrote = "Look at that."
    out.print(f"{wrote} Now type:", soft_wrap=True)
    out.print(f"  rems run {first}", soft_wrap=True)
    own = f"show {first}:{class_name(name)}"
    look = f"check {first}" if kind == "experiment" else own
    out.print(f"  rems {look}", soft_wrap=True)
    return 0


def template(kind: str, ending: str) -> str:
    """Return the file's template, with `$name` and `$Class` in it."""
    path = FOLDER / f"{kind}{'.txt' if ending == '.py' else ending}"
    return path.read_text(encoding="utf-8")


def class_name(name: str) -> str:
    """Return `MyRobot` for `my_robot`."""
    return "".join(word[:1].upper() + word[1:] for word in name.split("_"))


def check(kind: str, name: str, text: str) -> None:
    """Raise ExperimentError for a name that is invalid or taken."""
    if not _NAME.fullmatch(name):
        words = re.sub(r"[^A-Za-z0-9_]+", "_", re.sub(r"\.(py|toml)$", "", name))
        better = words.strip("_")[:37] or kind
        better = better if better[0].isalpha() else f"my_{better}"
        raise ExperimentError(
            f"{name!r} is no name for a file of Python; expected a letter, and then "
            f"letters, digits or '_', 40 at most. Type: rems new {kind} {better}"
            " (R0907)"
        )
    if kind == "experiment":
        return
    lines = re.findall(r"^(?:from|import|class) .*$", text, re.MULTILINE)
    if class_name(name) in re.findall(r"[$\w]+", " ".join(lines)):
        why = f"the file has another {class_name(name)!r} in it"
    elif keyword.iskeyword(name) or keyword.iskeyword(class_name(name)):
        why = "it is a word of Python's own"
    elif _is_module(name):
        why = f"{name}.py would hide the module {name!r} from all programs here"
    else:
        return
    raise ExperimentError(
        f"{name!r} will not do: {why}. Type: rems new {kind} my_{name} (R0907)"
    )


def _is_module(name: str) -> bool:
    """Return whether `import name` finds something; an empty folder does not count."""
    if name in sys.stdlib_module_names:
        return True
    spec = PathFinder.find_spec(name)  # not what this program has loaded by itself
    return spec is not None and spec.origin is not None
