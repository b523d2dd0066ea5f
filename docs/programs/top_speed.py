from rems_net import Definition, In, Out, Schema, Settings
from rems_net.drivers import Kinematic, combine
from rems_net.units import length, velocity


class Cart(Definition):
    parameters = Settings(top_speed=velocity("m/s", default=1.0))
    command = In(
        lambda p: Schema(
            "cart.command",
            {"speed": velocity("m/s", range=(-p.top_speed, p.top_speed))},
        )
    )
    state = Out(Schema("cart.state", {"x": length("m")}))

    def derivative(self, state, command):
        return {"x": command["speed"]}


cart = combine(Cart, Kinematic)("cart", parameters={"top_speed": "50 cm/s"})
cart.prepare()
cart.command = {"speed": 0.5}
cart.drive(cart.command, 2.0)
assert cart.state["x"] == 1.0
