from rems_net import Experiment, rule
from rems_net.units import boolean, percent

side = percent(range=(-100, 100))


@rule(
    needs={"up": boolean(), "space": boolean()},
    gives={"wheel/left": side, "wheel/right": side},
)
def sprint(keys):
    speed = 100.0 * keys["up"] if keys["space"] else 30.0 * keys["up"]
    return {"wheel/left": speed, "wheel/right": speed}


lab = Experiment("sprint", pace=1, duration="60 s")
lab.input("keys", "keyboard")
lab.robot("wood", "woodbot", "kinematic", command="input/keys", rules=[sprint])
with lab.engine() as engine:
    engine.put("input/keys/command", {"up": True, "space": True})
    engine.step(1)
    print(engine["robot/wood"].command["wheel/left"])
