"""The blades of a mill, as its deck describes them."""

import dataclasses


@dataclasses.dataclass(frozen=True)
class Blade:
    """A box on the rotor: `position` of its centre along x [m], `angle` at t = 0 from +y to +z [rad], reach `tip_radius` from
    the axis, `width` along and `thickness` around it [m], `pitch` [rad]."""

    position: float
    angle: float
    tip_radius: float
    width: float
    thickness: float
    pitch: float


def of(sections, number, turn=0.0) -> list[Blade]:
    """All blades, numbered as millsim numbers them: those of [blades], then each [blade.NAME]. `sections` of the deck in their
    order; number(key) is a value in SI, 0 where there is none; `turn` is added to their angles [rad]."""
    found = []
    for section in sorted(sections, key=lambda name: name != "blades"):
        keys = ("tip_radius", "width", "thickness", "pitch")
        if section == "blades":
            count, length = int(number("blades.count")), number("drum.length")
            for k in range(count):
                place = (k + 0.5) * length / count - length / 2
                angle = turn + k * number("blades.angle_step")
                found.append(Blade(place, angle, *(number(f"blades.{key}") for key in keys)))
        elif section.startswith("blade."):
            angle = turn + number(f"{section}.angle")
            size = (number(f"{section}.{key}") for key in keys)
            found.append(Blade(number(f"{section}.position"), angle, *size))
    return found
