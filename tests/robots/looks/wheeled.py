"""How the robots on two sides of wheels are drawn."""

from math import cos, radians, sin

from rems_net.bodies.body import Body, Ray
from tests.robots.looks.shapes import (
    BLACK,
    BLUE,
    DARK,
    GOLD,
    GREEN,
    GREY,
    ORANGE,
    RED,
    SILVER,
    TAN,
    WHITE,
    WOOD,
    YELLOW,
    Geom,
    Look,
    Y,
    box,
    disc,
    ring,
    rod,
    wheels,
)

#: the case of an FS90R
SERVO = (0.27, 0.29, 0.33)


def woodbot(body: Body) -> Look:
    """Return the look of the woodbot."""
    low, top = 0.0063, 0.0093  # of the board
    base = [
        box((0.010, 0.003, 0.0235), (-0.0708, 0, low - 0.0117), TAN),
        box((0.052, 0.028, 0.0016), (-0.036, 0, top + 0.004), BLACK),
        box((0.018, 0.016, 0.003), (-0.022, 0, top + 0.0062), SILVER),
        box((0.008, 0.009, 0.003), (-0.060, 0, top + 0.0062), SILVER),
        *(
            box((0.05, 0.0025, 0.004), (-0.036, y, top + 0.002), DARK)
            for y in (-0.012, 0.012)
        ),
        *(
            box((0.004, 0.004, 0.002), (0.006, y / 1000, top + 0.001), WHITE)
            for y in range(-25, 26, 10)
        ),
        # The lidars hang under the board: a small board, and a lens that looks out.
        box((0.0016, 0.02, 0.011), (0.0072, 0, low - 0.0055), BLUE),
        box((0.0012, 0.0055, 0.003), (0.0084, 0, low - 0.004), BLACK),
        box((0.02, 0.0016, 0.011), (-0.03575, -0.0008, low - 0.0055), BLUE),
        box((0.034, 0.046, 0.008), (-0.048, 0, low - 0.004), SILVER),
    ]
    for side in (-1, 1):
        base += [  # An FS90R, its shaft on the axle.
            box((0.0232, 0.0225, 0.0124), (-0.006, side * 0.0375, 0), SERVO),
            box((0.0322, 0.0022, 0.0124), (-0.006, side * 0.0435, 0), SERVO),
            disc(0.0058, (0, side * 0.0500, 0), 0.004, SERVO, Y),
            rod(0.0024, (0, side * 0.05, 0), (0, side * 0.0563, 0), WHITE),
        ]
    links = wheels(body, 0.0175, WOOD, bolts=6)
    return Look((WOOD, TAN), {"base": base, **links}, elevation=-17, rays=0.75)


def create2(body: Body) -> Look:
    """Return the look of the create2."""
    lid = 0.056  # top of the shell above the axles
    base = [
        disc(0.152, (0, 0, lid), 0.003, (0.60, 0.66, 0.58)),
        disc(0.040, (0, 0, lid + 0.001), 0.005, DARK),
        disc(0.034, (0, 0, lid + 0.002), 0.007, (0.42, 0.75, 0.25)),
        *(disc(0.013, (0, y, lid + 0.001), 0.005, DARK) for y in (-0.064, 0.064)),
        disc(0.014, (0.156, 0, lid + 0.006), 0.014, BLACK),
        box((0.09, 0.05, 0.003), (-0.105, 0, lid + 0.0005), GREY),
    ]
    for degrees in range(-88, 89, 4):  # the bumper, which gives all along the front
        c, s = cos(radians(degrees)), sin(radians(degrees))
        dark = degrees in (-64, -36, -12, 12, 36, 64)  # windows of the light bumpers
        for z, high, paint in ((0.011, 0.058, GREY), (0.013, 0.016, BLACK)):
            if paint is GREY or dark:
                away = 0.1735 if paint is GREY else 0.1745
                at = (away * c, away * s, z)
                base.append(box((0.007, 0.0135, high), at, paint, radians(degrees)))
    return Look((DARK, BLACK), {"base": base, **wheels(body, 0.022, GREY)})


def dynabot(body: Body) -> Look:
    """Return the look of the dynabot."""
    posts = [(x, y) for x in (0.04, -0.08) for y in (-0.048, 0.048)]
    base = [
        *(box((0.14, 0.12, 0.004), (-0.02, 0, z), DARK) for z in (0.0165, 0.0455)),
        *(rod(0.003, (x, y, 0.016), (x, y, 0.046), GOLD) for x, y in posts),
        box((0.07, 0.045, 0.022), (-0.015, 0, 0.03), BLUE),
        box((0.07, 0.06, 0.002), (-0.01, 0, 0.0505), GREEN),
        box((0.014, 0.014, 0.003), (-0.01, 0, 0.053), BLACK),
        box((0.012, 0.016, 0.010), (-0.038, 0.015, 0.0555), SILVER),
        box((0.012, 0.016, 0.010), (-0.038, -0.012, 0.0555), BLACK),
        rod(0.0115, (-0.08, 0, -0.020), (-0.08, 0, -0.010), DARK),
        rod(0.006, (-0.08, 0, -0.010), (-0.08, 0, 0.015), GREY),
    ]
    for side in (-1, 1):
        base += [
            box((0.0465, 0.034, 0.0285), (-0.012, side * 0.043, 0), BLACK),
            disc(0.0095, (0, side * 0.061, 0), 0.004, GREY, Y),
            rod(0.006, (0, side * 0.06, 0), (0, side * 0.08, 0), GREY),
        ]
    links = wheels(body, 0.023, ORANGE)
    return Look((None, SILVER), {"base": base, **links}, elevation=-18)


def epuck(body: Body) -> Look:
    """Return the look of the epuck."""
    clear, plate = (0.80, 0.84, 0.82), 0.030
    base = [
        disc(0.0356, (0, 0, plate + 0.0005), 0.0016, GREEN),
        *(
            rod(0.0018, (x, 0, -0.018), (0.7 * x, 0, -0.011), clear)
            for x in (-0.025, 0.025)
        ),
        disc(0.010, (-0.004, 0, plate + 0.003), 0.006, BLACK),
        disc(0.005, (-0.004, 0, plate + 0.0065), 0.001, SILVER),
        box((0.007, 0.007, 0.004), (0.016, 0.010, plate + 0.002), BLACK),
        box((0.010, 0.006, 0.003), (-0.022, -0.008, plate + 0.0015), SILVER),
        disc(0.0042, (0.0235, 0, 0.008), 0.006, BLACK, (1, 0, 0)),
        *(disc(0.0016, (x, y, plate + 0.002), 0.0025, RED) for x, y in ring(8, 0.0325)),
    ]
    for sense in body.sensors:
        if isinstance(sense, Ray):
            x, y, z = sense.at
            base.append(box((0.004, 0.004, 0.011), (x, y, z + 0.0035), BLACK))
    links = wheels(body, 0.0165, (0.35, 0.65, 0.3))
    return Look((clear, clear, SILVER), {"base": base, **links})


def _sonars(body: Body, shift: float) -> list[Geom]:
    """Return the round faces of sonars, so far outside of where their rays begin."""
    faces = []
    for sense in body.sensors:
        if isinstance(sense, Ray):
            x, y, z = sense.at
            c, s, _ = sense.direction
            face = (x + shift * c, y + shift * s, z)
            faces += [disc(0.0205, face, 0.006, SILVER, sense.direction)]
            faces += [disc(0.0165, face, 0.009, GOLD, sense.direction)]
    return faces


def pioneer3dx(body: Body) -> Look:
    """Return the look of the pioneer3dx."""
    base = [
        *_sonars(body, 0.007),
        box((0.06, 0.05, 0.03), (-0.2, 0, -0.015), BLACK),
        box((0.07, 0.05, 0.006), (0.02, -0.08, 0.147), GREY),
    ]
    links = wheels(body, 0.062, SILVER)
    return Look((RED, BLACK, BLACK, BLACK, DARK), {"base": base, **links})


def pioneer3at(body: Body) -> Look:
    """Return the look of the pioneer3at."""
    z = next(sense.at[2] for sense in body.sensors if isinstance(sense, Ray))
    base = [
        *_sonars(body, 0.004),
        *(disc(0.143, (x, 0, z), 0.05, BLACK) for x in (0.10, -0.095)),
        box((0.03, 0.05, 0.012), (-0.2, -0.12, 0.168), GREY),
    ]
    return Look((RED, BLACK), {"base": base, **wheels(body, 0.06, WHITE)})


def moose(body: Body) -> Look:
    """Return the look of the moose."""
    base = [
        box((2.4, 1.0, 0.10), (-0.1, 0, 0.42), DARK),
        *(disc(0.07, (1.49, y, 0.16), 0.06, WHITE, (1, 0, 0)) for y in (-0.3, 0.3)),
        box((0.06, 0.8, 0.12), (1.49, 0, -0.02), BLACK),
        *(box((2.9, 0.05, 0.05), (0, y, 0.23), BLACK) for y in (-0.71, 0.71)),
    ]
    return Look((BLACK, YELLOW), {"base": base, **wheels(body, 0.17, YELLOW)})
