import numpy

from rems_net import Input, Out, Woodbot


class Shaky(Input):
    value = Out(Woodbot.command)

    def open(self):
        self.rng = numpy.random.default_rng(self.random.getrandbits(64))

    def read(self, tick):
        left = 5 + self.random.gauss(0, 0.5)  # or, with numpy:
        return {"wheel": {"left": left, "right": self.rng.normal(5, 0.5)}}
