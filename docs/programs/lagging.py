from rems_net import Definition, In, Out, Schema, Settings
from rems_net.bodies import actuation
from rems_net.units import length, velocity


class Cart(Definition):
    parameters = Settings(actuation=actuation("speed", lag="90 ms", delay="60 ms"))
    command = In(Schema("command", {"speed": velocity(range=(-1, 1))}))
    state = Out(Schema("state", {"x": length()}))

    def derivative(self, state, command):
        return {"x": command["speed"]}
