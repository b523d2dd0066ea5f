"""How a youBot and SCALER's arms are drawn."""

from math import sqrt

from rems_net.bodies.body import Body, Vector
from tests.robots.looks.shapes import (
    BLACK,
    DARK,
    GREY,
    ORANGE,
    SILVER,
    Geom,
    Geoms,
    Look,
    X,
    Y,
    box,
    disc,
    joints,
    ring,
    rod,
)

#: of rollers, lighter than what is in their shade
RUBBER = (0.17, 0.17, 0.19)


def _mecanum(radius: float, hand: int, count: int = 9) -> list[Geom]:
    """Return a wheel whose rollers stand askew, `hand` 1 or -1, between two plates."""
    thick, along = 0.0105, 0.0145
    middle = sqrt((radius - thick) ** 2 - along**2)  # so that their ends touch
    found = [disc(0.024, (0, 0, 0), 0.046, SILVER, Y)]
    found += [disc(0.029, (0, y, 0), 0.003, SILVER, Y) for y in (-0.0235, 0.0235)]
    for c, s in ring(count):
        x, z = middle * c, middle * s
        way = -hand * s * along, along, hand * c * along
        start, end = ((x + f * way[0], f * way[1], z + f * way[2]) for f in (-1, 1))
        found.append(rod(thick, start, end, RUBBER, type="capsule"))
    return found


def youbot_base(body: Body) -> Look:
    base = [
        box((0.56, 0.25, 0.085), (0, 0, 0.027), DARK),
        box((0.30, 0.345, 0.075), (0, 0, 0.025), ORANGE),
        box((0.57, 0.35, 0.014), (0, 0, 0.073), SILVER),
        *(box((0.02, 0.33, 0.045), (x, 0, 0.015), GREY) for x in (-0.276, 0.276)),
        box((0.22, 0.25, 0.006), (-0.14, 0, 0.083), GREY),
        box((0.07, 0.13, 0.004), (0.2, 0, 0.081), DARK),
    ]
    hands = {"wheel/front/left": -1, "wheel/front/right": 1}
    hands |= {"wheel/rear/left": 1, "wheel/rear/right": -1}
    rolling = {name: _mecanum(body.height, hand) for name, hand in hands.items()}
    return Look((None,), {"base": base, **rolling}, ("wheel",), elevation=-16)


def youbot_arm(body: Body) -> Look:
    x, y, z = (body.joints[-1] if body.joints else None).at  # type: ignore[union-attr]

    def across(radius: float, at: float, wide: float, ahead: float = 0.0) -> list[Geom]:
        """A motor of the next joint: black, with a silver cap on either side."""
        middle = (ahead, 0.0, at)
        cap = disc(0.6 * radius, middle, wide + 0.006, SILVER, Y)
        return [disc(radius, middle, wide, BLACK, Y), cap]

    def link(thick: float, begin: float, end: float) -> Geom:
        """The cast part between two motors."""
        size = (thick, 0.9 * thick, end - begin)
        return box(size, (0.0, 0.0, (begin + end) / 2), ORANGE)

    links = {
        "base": [
            disc(0.068, (x, y, z + 0.020), 0.04, BLACK),
            disc(0.060, (x, y, z + 0.045), 0.012, SILVER),
        ],
        "arm/joint/1": [
            rod(0.055, (0, 0, 0.05), (0, 0, 0.098), ORANGE),
            box((0.085, 0.07, 0.06), (0.02, 0, 0.115), ORANGE),
            *across(0.044, 0.147, 0.10, 0.033),
        ],
        "arm/joint/2": [link(0.062, 0.02, 0.135), *across(0.037, 0.155, 0.085)],
        "arm/joint/3": [link(0.052, 0.02, 0.115), *across(0.032, 0.135, 0.075)],
        "arm/joint/4": [
            link(0.046, 0.02, 0.095),
            rod(0.026, (0, 0, 0.095), (0, 0, 0.13), BLACK),
        ],
        "arm/joint/5": [
            rod(0.022, (0, 0, 0), (0, 0, 0.03), SILVER),
            box((0.034, 0.085, 0.018), (0, 0, 0.037), BLACK),
        ],
    }
    return Look((None,), links, bare=("arm/joint",))


def youbot(body: Body) -> Look:
    below, above = youbot_base(body), youbot_arm(body)
    base = {"base": below.links["base"] + above.links["base"]}
    links = {**below.links, **above.links, **base}
    return Look((None,), links, ("wheel", "arm/joint"), elevation=-17)


def scaler(body: Body) -> Look:
    found = {joint.name: joint for joint in joints(body.joints)}
    links: Geoms = {
        "base": [
            *(box((0.07, 0.34, 0.004), (0.136, 0, z), DARK) for z in (0.027, -0.027)),
            rod(0.018, (-0.06, 0, -0.025), (-0.06, 0, -body.height), GREY),
            disc(0.13, (-0.03, 0, 0.006 - body.height), 0.012, GREY),
        ]
    }
    arms = [arm for arm in ("left", "right") if f"{arm}/shoulder" in found]
    for arm in arms:
        shoulder = found[f"{arm}/shoulder"]
        (_, aside, _), y = shoulder.parts[0].at, shoulder.at[1]
        servos = [joint.at[2] for joint in shoulder.joints]
        links["base"].append(box((0.034, 0.0285, 0.0465), (0.136, y, 0), BLACK))
        links[shoulder.name] = [
            disc(0.014, (0, 0, -0.034), 0.014, SILVER),
            box((0.062, 0.056, 0.004), (0, aside, -0.043), SILVER),
            *(
                box((0.004, 0.056, 0.078), (x, aside, -0.08), SILVER)
                for x in (-0.03, 0.03)
            ),
            *(box((0.05, 0.0465, 0.0265), (0, aside, z), BLACK) for z in servos),
        ]
        for name in ("top", "bottom", "knee", "plate"):
            links[f"{arm}/{name}"] = [disc(0.015, (0, 0, 0), 0.036, BLACK, X)]
        for number, size in (1, (0.034, 0.0285, 0.0465)), (2, (0.0285, 0.0465, 0.034)):
            links[f"{arm}/wrist/{number}"] = [box(size, (0, 0, 0), BLACK)]
        # The gripper at the end of the rod: a palm and two fingers.
        tip = [2 * part for part in found[f"{arm}/wrist/3"].parts[0].at]

        def at(share: float, out: float = 0.0, tip: list[float] = tip) -> Vector:
            return share * tip[0] + out, share * tip[1], share * tip[2]

        links[f"{arm}/wrist/3"] = [
            rod(0.024, at(0.62), at(0.78), DARK),
            *(
                rod(0.006, at(0.78, out), at(1.2, 0.7 * out), SILVER)
                for out in (-0.018, 0.018)
            ),
        ]
    return Look((DARK,), links, tuple(f"{arm}/shoulder" for arm in arms))
