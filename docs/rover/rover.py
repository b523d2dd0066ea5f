from rems_net import (
    Definition,
    Driver,
    In,
    Input,
    Out,
    Output,
    Process,
    Schema,
    Settings,
    cos,
    sin,
)
from rems_net.units import angle, angular_velocity, length, ratio, velocity


class Rover(Definition):
    """A cart that is told how fast to drive and to turn."""

    command = In(Schema("command", {"speed": velocity(), "turn": angular_velocity()}))
    state = Out(Schema("state", {"x": length(), "y": length(), "heading": angle()}))

    def derivative(self, state, command):
        v, heading = command.speed, state.heading
        return {"x": v * cos(heading), "y": v * sin(heading), "heading": command.turn}


class Slipping(Driver):
    """Moves a robot by its definition's mathematics, on wheels that slip."""

    options = Settings(slip=ratio(default=0.1, range=(0, 1), doc="of the way is lost"))

    def drive(self, command, dt):
        for field, rate in self.derivative(self.state, command).items():
            self.state[field] += (1 - self.options.slip) * rate * dt

    def sense(self):
        pass  # drive has said where it is, and a rover has no sensors


class Circle(Input):
    """Drives in a circle."""

    value = Out(Rover.command)

    def read(self, tick):
        return {"speed": 0.2, "turn": 0.5}


class Calm(Process):
    """Passes a command on, slowed down."""

    told = In(Rover.command)
    value = Out(Rover.command)
    options = Settings(factor=ratio(default=0.5, range=(0, 1)))

    def step(self, tick):
        factor = self.options.factor
        self.value = {path: factor * value for path, value in self.told.items()}


class Diary(Output):
    """Writes a line per step, for people to read."""

    state = In(Rover.state)

    def open(self):
        self.path = self.out / f"{self.name}.txt"
        self.file = self.path.open("w", encoding="utf-8")

    def write(self, tick):
        print(f"{tick.t:.1f} s: x = {self.state.x:.3f} m", file=self.file)

    def close(self):
        self.file.close()

    def made(self):
        return [self.path]
