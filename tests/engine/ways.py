"""Run what a file runs in three ways, and print the files that differ.

    python -m tests.engine.ways EXPERIMENT OUT

Everything goes to OUT/engine, OUT/one and OUT/many: in the engine, in one host, and in
the hosts of the file. Prints `NAME: N files, of which differ: ...` for each experiment.
"""

import shutil
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from rems_net import Experiment
from rems_net.agents.experiment.file import load
from rems_net.agents.experiment.folder import Result
from rems_net.agents.experiment.show import Show
from rems_net.cli.script import run_script
from rems_net.errors import MissingPartError

WAYS = ("engine", "one", "many")


def compare(lab: Experiment, out: Path) -> Result | None:
    """Run it in the three ways. Experiments with devices are left alone."""
    for key, plan in list(lab.plans.items()):
        try:
            plan.build().prepare()
        except MissingPartError:
            del lab.plans[key]
    if not all(agent.lockstep for agent in lab.check().values()):
        print(f"{lab.name}: drives devices", flush=True)
        return None
    plans, found, result = lab.plans, {}, None
    # Robots of a world are in its host; nothing but its host says that they are.
    one = next((plan.world for plan in plans.values() if plan.world), "all")
    for way in WAYS:
        lab.plans = {key: replace(plan) for key, plan in plans.items()}
        for plan in lab.plans.values():
            plan.machine, plan.restart = "", 0
            if way == "one" and (one == "all" or plan.kind != "robot"):
                plan.host = one
        folder = out / way / lab.name
        result = lab.run(folder, direct=way == "engine", pace="fast", show=Show())
        found[way] = {
            path.relative_to(folder): path.read_bytes()
            for path in sorted(folder.rglob("*"))
            if path.is_file() and path.name != "run.json"
        }
    names = set().union(*found.values())
    other = [str(n) for n in names if len({found[way].get(n) for way in WAYS}) > 1]
    differ = ", ".join(sorted(other)) or "none"
    print(f"{lab.name}: {len(names)} files, of which differ: {differ}", flush=True)
    return result


def main() -> None:
    file, out = Path(sys.argv[1]), Path(sys.argv[2])

    def runner(lab: Experiment, *_: Any, **__: Any) -> Result | None:
        result = compare(lab, out)
        if result is not None:  # what the script reads by its name afterwards
            shutil.copytree(result.folder, Path("runs") / lab.name, dirs_exist_ok=True)
        return result

    if file.suffix == ".py":
        run_script(file, [], runner)
    else:
        compare(load(file), out)


if __name__ == "__main__":
    main()
