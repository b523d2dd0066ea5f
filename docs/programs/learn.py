from rems_net import Experiment, Input, Out, Woodbot


class Keys(Input):
    value = Out(Woodbot.command)

    def read(self, tick):
        if tick.n % 6 == 1:
            left, right = self.random.choices((-3, 0, 3, 6), k=2)
            return {"wheel/left": left, "wheel/right": right}
        return None  # the last values hold


learn = {
    "definition": "woodbot",
    "parameters": "arena_radius = 0",
    "save": "weights.json",
}
lab = Experiment("learn", dt="0.1 s", duration="30 s")
lab.input("keys", Keys)
lab.robot(
    "real", "woodbot", "mujoco", command="input/keys", parameters={"arena_radius": 0}
)
ports = {"command": "robot/real/command", "state": "robot/real/state"}
lab.process("learner", "residual", options=learn, **ports)
lab.run("learned", direct=True)
