from rems_net import Experiment

lab = Experiment("race", pace=1, duration="60 s")
lab.input("stick", "hand")
lab.robot("small", "woodbot", "kinematic", command="input/stick")
lab.robot("large", "moose", "kinematic", command="input/stick")
lab.output("log", "csv")
with lab.engine() as engine:
    engine.put("input/stick/command", {"ahead": 50})
    engine.step(3)
    print(engine["robot/large"].command["wheel/left"])
