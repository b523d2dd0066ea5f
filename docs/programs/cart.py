from rems_net import ConformanceError, Definition, Driver, In, Out, Schema, check_robot
from rems_net.units import length, velocity


class Cart(Definition):
    command = In(Schema("command", {"speed": velocity(range=(-1, 1))}))
    state = Out(Schema("state", {"x": length()}))

    def derivative(self, state, command):
        return {"x": command.speed}


class Rolling(Driver):
    trips = 0.0

    def drive(self, command, dt):
        self.trips += command.speed * dt
        self.state.x = self.trips

    def sense(self):
        pass


try:
    check_robot(Cart, Rolling, alone=True)
except ConformanceError as found:
    print(found)
else:
    raise SystemExit("nothing was found")
