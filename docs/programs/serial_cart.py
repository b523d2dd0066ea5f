from rems_net import Definition, Experiment, In, Input, Out, Schema, WireError
from rems_net.drivers import SerialDriven
from rems_net.units import angle, angular_velocity, length, velocity

COMMAND = Schema(
    "cart.command",
    {"speed": velocity(range=(-1, 1)), "turn": angular_velocity(range=(-2, 2))},
)
STATE = Schema("cart.state", {"x": length(), "y": length(), "heading": angle()})


class Cart(Definition):
    command = In(COMMAND)
    state = Out(STATE)


def check(text):
    return f"{sum(text.encode()) % 256:02x}"


class MyCart(SerialDriven):
    rate = 50.0
    number = 0

    def exchange(self, command):
        self.number += 1
        text = f"{self.number} {command.speed} {command.turn}"
        reply = self.ask(f"{text} {check(text)}\n".encode())
        text, _, mark = reply.decode(errors="replace").strip().rpartition(" ")
        number, *values = text.split(" ")
        if mark != check(text) or number != str(self.number):
            raise WireError(f"no answer to {self.number}: {reply!r}")
        x, y, heading = map(float, values)
        return {"state": {"x": x, "y": y, "heading": heading}}


class Ahead(Input):
    value = Out(COMMAND)

    def read(self, tick):
        return {"speed": 0.2, "turn": 0.5}


lab = Experiment("cart", dt="20 ms", duration="2 s", pace=1)
lab.input("ahead", Ahead)
lab.robot("cart", Cart, MyCart, command="input/ahead", options={"port": "/dev/ttyUSB0"})
lab.output("log", "csv")
lab.run()
