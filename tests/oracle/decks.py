"""Random small mills: a deck, a start file, and what the oracle makes of them.

A deck is first made as text, section by section, and the oracle's mill is read back from that text,
so both sides work from the same words. Shapes leave every ball room: no ball can be pinched between
a blade and the drum or an end wall, since a pinch has no outcome to agree upon.
"""

from dataclasses import dataclass

import numpy as np
from oracle import KINDS, Blade, Law, Mill, Simulation, length, wavy_arcs

ROOM = 1.3  # ball diameters left free between a blade and the drum or an end wall
APART = 2e-4  # m, least gap at the start
BALLS = (6, 5, 4, 6, 3, 6, 5, 1, 6, 4, 2)  # how many, by seed
UNITS = {
    "m": 1.0,
    "mm": 1e-3,
    "s": 1.0,
    "rpm": 2 * np.pi / 60,
    "deg": np.pi / 180,
    "kg/m^3": 1.0,
    "g/cm^3": 1e3,
    "m/s": 1.0,
    "mm/s": 1e-3,
    "m/s^2": 1.0,
}


@dataclass
class Case:
    seed: int
    sections: dict
    mill: Mill
    position: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    columns: int  # of the start file: 3, 6 or 9

    def simulation(self):
        return Simulation(self.mill, self.position, self.velocity, self.spin)

    def deck(self, time):
        """The deck's text for a run until `time` [s]."""
        sections = {"run": {"time": f"{time!r} s"}, **self.sections}
        return "\n".join(
            f"[{name}]\n" + "".join(f"{key} = {value}\n" for key, value in keys.items())
            for name, keys in sections.items()
        )

    def start(self):
        """The start file: numbers in full, so that both sides start from the same bits."""
        rows = np.hstack([self.position, self.velocity, self.spin])[:, : self.columns]
        return "# a start\n" + "".join(" ".join(map(repr, row)) + "\n" for row in rows.tolist())


# Reading the deck as the oracle understands it


def si(text):
    """'75 mm' in SI; a bare number; several numbers and one unit give an array."""
    words = text.split()
    if words[-1] not in UNITS:
        return float(text)
    numbers = [float(word) * UNITS[words[-1]] for word in words[:-1]]
    return np.array(numbers) if len(numbers) > 1 else numbers[0]


def blade_of(keys, position, angle):
    pitch = si(keys.get("pitch", "0 deg"))
    sizes = (si(keys[name]) for name in ("tip_radius", "width", "thickness"))
    return Blade(position, angle, *sizes, pitch)


def blades_of(sections, drum_length):
    blades = []
    if "blades" in sections:
        keys = sections["blades"]
        count = int(keys["count"])
        step = si(keys.get("angle_step", f"{360 / count!r} deg"))
        for k in range(count):
            x = -drum_length / 2 + (k + 0.5) * drum_length / count
            blades.append(blade_of(keys, x, k * step))
    for name, keys in sections.items():
        if name.startswith("blade."):
            blades.append(blade_of(keys, si(keys["position"]), si(keys["angle"])))
    return tuple(blades)


def laws_of(sections):
    laws = {}
    for kind in KINDS:
        keys = {"friction": "0", "tangential_restitution": "0", **sections["contact"]}
        keys.update(sections.get(f"contact.{kind}", {}))
        names = ("restitution", "friction", "tangential_restitution")
        laws[kind] = Law(*(float(keys[name]) for name in names))
    return laws


def mill_of(sections):
    kinds = [keys for name, keys in sections.items() if name.startswith("balls.")]
    kinds = kinds or [sections["balls"]]
    counts = [int(keys["count"]) for keys in kinds]
    rotor = sections.get("rotor", {})
    length = si(sections["drum"]["length"])
    return Mill(
        drum_radius=si(sections["drum"]["radius"]),
        drum_length=length,
        radius=np.repeat([si(keys["diameter"]) / 2 for keys in kinds], counts),
        density=np.repeat([si(keys["density"]) for keys in kinds], counts),
        laws=laws_of(sections),
        rebound_floor=si(sections["contact"].get("rebound_floor", "5 mm/s")),
        gravity=si(sections.get("gravity", {}).get("acceleration", "0 0 -9.81 m/s^2")),
        shaft_radius=si(rotor.get("shaft_radius", "0")),
        rotor_speed=si(rotor.get("speed", "0 rpm")),
        rotor_angle=si(rotor.get("angle", "0 deg")),
        blades=blades_of(sections, length),
        buckles=int(sections["drum"].get("buckles", 0)),
        buckle_height=si(sections["drum"].get("buckle_height", "0 mm")),
        buckle_angle=si(sections["drum"].get("buckle_angle", "0 deg")),
    )


# Making decks


def number(rng, low, high, digits):
    return f"{rng.uniform(low, high):.{digits}f}"


def random_balls(rng, count, largest):
    """Sections of one kind of ball, or of a mixture, `largest` mm in diameter at most."""
    kinds = 1 if count == 1 or rng.random() < 0.5 else int(rng.integers(2, min(count, 3) + 1))
    if kinds == 1:
        size = f"{largest:.2f} mm"
        return {"balls": {"count": f"{count}", "diameter": size, "density": "7800 kg/m^3"}}
    sections = {"balls": {}}
    share = rng.multinomial(count - kinds, np.full(kinds, 1 / kinds)) + 1
    for name, few in zip(rng.permutation(["steel", "glass", "zirconia"]), share.tolist()):
        sections[f"balls.{name}"] = {
            "count": f"{few}",
            "diameter": f"{number(rng, 0.5 * largest, largest, 2)} mm",
            "density": f"{number(rng, 2.2, 8.0, 2)} g/cm^3",
        }
    return sections


def random_blade(rng, drum, shaft, free_length, largest):
    """Keys of a blade that leaves room to the drum and fits in `free_length` (mm) along the axis,
    and its extent along the axis; None when the dice were bad."""
    width, thickness = rng.uniform(4, 0.5 * free_length), rng.uniform(1.5, 5)
    pitch = rng.uniform(-60, 60) if rng.random() < 0.8 else 0.0
    cos, sin = np.cos(np.radians(pitch)), abs(np.sin(np.radians(pitch)))
    extent = width * cos + thickness * sin
    across = (width * sin + thickness * cos) / 2
    longest = (drum - ROOM * largest) ** 2 - across**2
    if longest <= (shaft + 4) ** 2 or extent + 2 * ROOM * largest > free_length:
        return None
    tip = rng.uniform(max(shaft + 4, 0.8 * np.sqrt(longest)), np.sqrt(longest))
    keys = {
        "tip_radius": f"{np.floor(tip * 100) / 100:.2f} mm",
        "width": f"{width:.2f} mm",
        "thickness": f"{thickness:.2f} mm",
    }
    if pitch:
        keys["pitch"] = f"{pitch:.1f} deg"
    return keys, extent


def random_blades(rng, drum, length, shaft, largest):
    """Sections of the blades: [blades], some [blade.NAME], or both."""
    way = rng.choice(["even", "named", "named", "both"])
    sections = {}
    while way != "named" and "blades" not in sections:
        count = int(rng.integers(1, 4))
        if made := random_blade(rng, drum, shaft, length / count, largest):
            sections["blades"] = {"count": f"{count}", **made[0]}
            if rng.random() < 0.5:
                sections["blades"]["angle_step"] = f"{number(rng, -150, 150, 1)} deg"
    names = ["paddle", "b2", "Left-one"][: 0 if way == "even" else rng.integers(1, 4)]
    while names:
        if made := random_blade(rng, drum, shaft, length, largest):
            keys, extent = made
            reach = length / 2 - extent / 2 - ROOM * largest
            sections[f"blade.{names.pop(0)}"] = {
                "position": f"{number(rng, -reach, reach, 2)} mm",
                "angle": f"{number(rng, -180, 360, 1)} deg",
                **keys,
            }
    return sections


def random_laws(rng, frictional):
    contact = {"restitution": number(rng, 0.75, 1, 3)}
    if frictional:
        contact["friction"] = number(rng, 0.02, 0.5, 3)
        contact["tangential_restitution"] = number(rng, -0.5, 0.9, 3)
    if rng.random() < 0.3:
        contact["rebound_floor"] = f"{number(rng, 1, 20, 1)} mm/s"
    sections = {"contact": contact}
    for kind in KINDS:
        own = {}
        if rng.random() < 0.3:
            own["restitution"] = number(rng, 0.6, 1, 3)
        if frictional and rng.random() < 0.3:
            own["friction"] = rng.choice(["0", number(rng, 0, 0.5, 3)])
        if frictional and rng.random() < 0.3:
            own["tangential_restitution"] = number(rng, -0.5, 0.9, 3)
        if own:
            sections[f"contact.{kind}"] = own
    return sections


def random_gravity(rng, seed):
    if seed % 5 == 0:
        return {"gravity": {"acceleration": "0 0 0 m/s^2"}}
    if seed % 5 <= 2:
        tilt = " ".join(number(rng, -9, 9, 2) for _ in range(3))
        return {"gravity": {"acceleration": f"{tilt} m/s^2"}}
    return {}


def random_buckles(rng, seed, drum, largest):
    """Keys of a wavy drum whose innermost points are `drum` mm from the axis: shallow, deep, overhanging in turn. Every
    other of these last has arcs that are too narrow for the largest balls."""
    while True:
        n = int(rng.integers(2, 21))
        overhang = np.sin(np.pi / (2 * n))
        deep = (rng.uniform(0.02, 0.3), rng.uniform(0.3, 0.95), rng.uniform(1.02, 1.5))[seed % 3]
        height = np.round(drum * deep * overhang / (1 - deep * overhang), 2)
        if not 0.1 <= height <= 0.4 * drum:
            continue
        keys = {
            "radius": f"{drum + height:.2f} mm",
            "profile": "wavy",
            "buckles": f"{n}",
            "buckle_height": f"{height:.2f} mm",
        }
        if rng.random() < 0.7:
            keys["buckle_angle"] = f"{number(rng, -180, 360, 1)} deg"
        mill = Mill(si(keys["radius"]), 1.0, np.zeros(1), np.ones(1), {},
                    buckles=n, buckle_height=si(keys["buckle_height"]))  # fmt: skip
        centre, rho, _, half = wavy_arcs(mill)
        # neighbouring bulges, and what stands between them, must not run into each other where arcs pass a half circle
        apart = min(length(centre[2] - centre[0]), length(centre[3] - centre[1])) if n > 2 else 1.0
        fits = 2 * rho > 1e-3 * largest
        if fits == (seed % 6 != 5) and apart > 2 * rho + 1e-4:
            return keys


def random_sections(rng, seed, wavy):
    drum, length = np.round(rng.uniform(30, 60), 1), np.round(rng.uniform(40, 80), 1)
    largest = np.round(min(rng.uniform(0.15, 0.3) * drum, (length - 12) / (2 * ROOM)), 2)
    sections = random_gravity(rng, seed)
    sections.update(random_balls(rng, BALLS[seed % len(BALLS)], largest))
    sections["balls"]["start"] = "start.txt"
    sections["drum"] = {"radius": f"{drum} mm", "length": f"{length} mm"}
    if wavy:
        sections["drum"].update(random_buckles(rng, seed, drum, largest))
    shaft = np.round(rng.uniform(0.1, 0.2) * drum, 1)
    speed = np.exp(rng.uniform(np.log(60), np.log(1500))) * (-1) ** (seed // 2)
    if seed % 20 != 13:  # a few mills have no rotor, a few a bare shaft
        sections["rotor"] = {"speed": f"{speed:.1f} rpm", "shaft_radius": f"{shaft} mm"}
        if rng.random() < 0.7:
            sections["rotor"]["angle"] = f"{number(rng, -180, 360, 1)} deg"
        if seed % 20 != 4:
            sections.update(random_blades(rng, drum, length, shaft, largest))
    sections.update(random_laws(rng, frictional=seed % 4 != 0))
    sections["output"] = {"impacts": "all", "frames": "0 s"}
    return sections


def random_positions(rng, mill):
    """Ball centres anywhere free, each drawn until it keeps APART from all that is there."""
    reach = mill.drum_radius + mill.buckle_height
    box = np.array([mill.drum_length / 2, reach, reach])
    placed = np.zeros((0, 3))
    while len(placed) < len(mill.radius):
        trial = np.vstack([placed, rng.uniform(-box, box)])
        held = len(trial)
        part = Mill(**{**vars(mill), "radius": mill.radius[:held], "density": mill.density[:held]})
        gaps, _ = Simulation(part, trial, 0 * trial, 0 * trial).gaps(np.zeros(1))
        if np.hypot(*trial[-1, 1:]) < reach and gaps.min() > APART:
            placed = trial
    return placed


def random_case(seed, wavy=False):
    rng = np.random.default_rng([20240817, seed, 6] if wavy else [20240817, seed])
    sections = random_sections(rng, seed, wavy)
    mill = mill_of(sections)
    position = random_positions(rng, mill)
    columns = {0: 6, 1: 3}.get(seed % 12, 9)
    velocity = rng.normal(0, rng.uniform(1, 4), position.shape) * (columns >= 6)
    spin = rng.normal(0, 100, position.shape) * (columns == 9)
    return Case(seed, sections, mill, position, velocity, spin, columns)
