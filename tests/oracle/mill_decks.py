"""Random small mills of any bodies and motions: random_mill(seed) makes a deck of section 6 of the contract.

Three families: a jar that moves and holds nothing but balls; a tank with bodies in it, each on a motion of its own;
a drum that moves, or that stands about a rotor with pins. As in decks.py the deck is made as text and the oracle's
mill is read back from it. What moves against something else keeps ROOM for every ball at all times, so that no ball
is pinched.

Sizes are those of laboratory mills, in mm; the fastest points of the walls make 0.3 to 5 m/s.
"""

import numpy as np
from decks import APART, ROOM, number, random_balls, random_gravity
from mill_parts import (
    lengths,
    random_angle,
    random_axis,
    random_motion,
    random_shape,
    slender,
    speed_text,
    turn,
)
from motions import times
from oracle import KINDS, length
from read_mill import AnyCase, any_mill_of
from shapes import Drum, Shaft

CONTAINERS = ("cylinder", "capsule", "box", "cone", "sphere", "box mesh", "prism mesh")
BODIES = (
    "cylinder",
    "box",
    "cone",
    "box mesh",
    "capsule",
    "round box",
    "sphere",
    "round cylinder",
    "prism mesh",
    "round cone",
)
MOTIONS = ("turn", "planetary", "swing", "shift", "table", "swing on swing", "turn on shift")
DRUMS = ("lifters", "wavy", "rotor", "wavy rolling", "lifters rolling", "any")
BALLS = (3, 2, 6, 4, 1, 5, 2, 3)  # how many, by seed
SLOWEST, FASTEST = 0.3, 5.0  # m/s, of the fastest point of a wall that moves


def centred(rng, keys):
    """The body's keys with any axis and angle."""
    keys = {**keys, "axis": random_axis(rng)}
    if rng.random() < 0.5:
        keys["angle"] = random_angle(rng)
    return keys


def jar_sections(rng, index):
    """A container on a motion, sometimes with a baffle on the same motion; and its files."""
    size = rng.uniform(12, 45)
    way = MOTIONS[(index + index // 7) % 7]
    arm = rng.choice([0.0, rng.uniform(0, 1), rng.uniform(1, 3)]) * size
    arm = max(arm, size) if way == "planetary" else arm
    sections, files, centre = random_motion(rng, way, "m", arm, 1.3 * size, rng.uniform(1, 12))
    keys, own = random_shape(rng, CONTAINERS[index % 7], size, "jar")
    jar = {**centred(rng, keys), "side": "inside", "motion": "m", "centre": lengths(centre)}
    sections["body.jar"] = jar
    if rng.random() < 0.3:  # rides on the jar's motion, through its wall or not
        keys, more = slender(rng, str(rng.choice(BODIES)), 0.15 * size, "baffle")
        at = centre + rng.uniform(-0.6, 0.6, 3) * size
        sections["body.baffle"] = {**centred(rng, keys), "motion": "m", "centre": lengths(at)}
        files.update(more)
    return sections, {**files, **own}


def tank_sections(rng, index):
    """A container that stands, and bodies on motions in it."""
    size = rng.uniform(28, 50)
    keys, files = random_shape(rng, CONTAINERS[(index + 3) % 7], size, "tank")
    sections = {"body.tank": {**centred(rng, keys), "side": "inside"}}
    count = 1 + index // 2 % 3
    for k in range(count):
        part = f"part{k}"
        body, more = slender(rng, BODIES[(3 * index + k) % 10], size * rng.uniform(0.12, 0.4) / np.sqrt(count), part)
        if k == 0 or rng.random() < 0.4:
            way = MOTIONS[(index + k) % 7]
            reach, stroke = 0.3 * size, rng.uniform(0.05, 0.25) * size
            made = random_motion(rng, way, f"m{k}", rng.uniform(0, 0.3) * size, reach, stroke)
            moves, more_files, centre = made
            sections.update(moves)
            files.update(more_files)
            motion = f"m{k}"
        else:  # with the first, or it stands
            motion = str(rng.choice(["m0", ""]))
            centre = rng.uniform(-0.6, 0.6, 3) * size
        body = {**centred(rng, body), "centre": lengths(centre)}
        if motion:
            body["motion"] = motion
        if motion == "m0" and rng.random() < 0.6:
            body.update(random_copies(rng, size))
        sections[f"body.{part}"] = body
        files.update(more)
    return sections, files


def random_copies(rng, size):
    copies = int(rng.integers(2, 5))
    keys = {"copies": f"{copies}", "turn_by": f"{360 / copies:.6f} deg"}
    keys["turn_about"] = random_axis(rng)
    if rng.random() < 0.5:
        keys["shift_by"] = lengths(rng.uniform(-0.15, 0.15, 3) * size)
    return keys


def drum_sections_of(rng, index):
    way = DRUMS[index % 6]
    radius, half = rng.uniform(25, 55), rng.uniform(15, 40)
    drum = {"radius": lengths(radius), "length": lengths(2 * half)}
    if way == "rotor":
        return {"drum": drum, **rotor_sections(rng, radius, half)}, {}
    sections, files = {"drum": {**drum, "motion": "m"}}, {}
    rate = rng.uniform(0.4, 2) * 1e3 / radius * rng.choice([-1, 1])
    if way in ("lifters", "wavy"):
        sections["motion.m"] = turn(rng, rate, None, "1 0 0")
    elif way == "any":
        moves = random_motion(rng, MOTIONS[index // 6 % 7], "m", 0.5 * radius, radius, radius / 6)
        sections.update(moves[0])
        files.update(moves[1])
    else:  # it rolls to and fro: the turn of a swing, and a shift
        sections["motion.m"] = {"kind": "turn", "axis": "1 0 0", "speed": speed_text(rng, rate / 2)}
        sections["motion.m"]["on"] = "m_under"
        shifts = {"kind": "shift", "amplitude": lengths([0, radius / 5, 0])}
        sections["motion.m_under"] = {**shifts, "frequency": f"{rng.uniform(3, 20):.2f} Hz"}
    if way.startswith("wavy"):
        wave = radius * rng.uniform(0.02, 0.15)
        sections["drum"].update(profile="wavy", buckles=f"{rng.integers(3, 14)}")
        sections["drum"].update(buckle_height=lengths(wave), buckle_angle=random_angle(rng))
    else:
        sections["body.lifter"] = lifter(rng, radius, half)
    return sections, files


def lifter(rng, radius, half):
    """Boxes along the drum, in part within its wall."""
    tall, thick = radius * rng.uniform(0.1, 0.4), radius * rng.uniform(0.06, 0.2)
    copies = int(rng.integers(1, 5))
    return {
        "shape": "box",
        "motion": "m",
        "size": lengths([2 * half * rng.uniform(0.6, 1.1), thick, 2 * tall]),
        "centre": lengths([0, 0, -radius]),
        "angle": f"{number(rng, -20, 20, 1)} deg",
        "copies": f"{copies}",
        "turn_by": f"{360 / copies:.6f} deg",
        "turn_about": "1 0 0",
    }


def rotor_sections(rng, radius, half):
    """A rotor of the old deck with a body on it, and sometimes blades."""
    rate = rng.uniform(0.5, 3.5) * 1e3 / radius * rng.choice([-1, 1])
    shaft = radius * rng.uniform(0.1, 0.2)
    rotor = {"speed": f"{rate * 60 / (2 * np.pi):.2f} rpm", "shaft_radius": lengths(shaft)}
    rotor["angle"] = random_angle(rng)
    tip = radius * rng.uniform(0.4, 0.7)
    copies, pitch = int(rng.integers(2, 5)), half * rng.uniform(0.1, 0.3)
    pin = {
        "shape": str(rng.choice(["cylinder", "capsule"])),
        "motion": "rotor",
        "axis": "0 1 0",
        "radius": lengths(radius * rng.uniform(0.05, 0.12)),
        "length": lengths(tip),
        "centre": lengths([-(copies - 1) * pitch / 2, tip / 2, 0]),
        "copies": f"{copies}",
        "turn_by": f"{360 / copies:.6f} deg",
        "turn_about": "1 0 0",
        "shift_by": lengths([pitch, 0, 0]),
    }
    sections = {"rotor": rotor, "body.pin": pin}
    if rng.random() < 0.5:
        sizes = {"width": lengths(0.3 * half), "thickness": lengths(0.1 * radius)}
        sections["blades"] = {"count": "2", "tip_radius": lengths(tip), **sizes, "pitch": "20 deg"}
    return sections


def random_laws(rng, sections, frictional):
    contact = {"restitution": number(rng, 0.3, 1, 3)}
    if frictional:
        contact["friction"] = number(rng, 0.02, 0.5, 3)
        contact["tangential_restitution"] = number(rng, -0.5, 0.9, 3)
    if rng.random() < 0.6:
        contact["rebound_floor"] = f"{number(rng, 5, 150, 1)} mm/s"
    bodies = [name for name in sections if name.startswith("body.")]
    if len(bodies) > 2 and rng.random() < 0.5:  # those that belong together
        for name in bodies[1:]:
            sections[name]["kind"] = "ball_inner"
    kinds = {sections[name].get("kind", "ball_" + name.removeprefix("body.")) for name in bodies}
    kinds |= {kind for kind in KINDS[:3] if kind == "ball_ball" or "drum" in sections}
    laws = {"contact": contact}
    for kind in sorted(kinds):
        own = {}
        if kind == "ball_tank":  # lively, so that balls come back to the bodies
            own["restitution"] = number(rng, 0.85, 1, 3)
        elif rng.random() < 0.5:
            own["restitution"] = number(rng, 0.3, 1, 3)
        if frictional and rng.random() < 0.3:
            own["friction"] = rng.choice(["0", number(rng, 0, 0.5, 3)])
        if own:
            laws[f"contact.{kind}"] = own
    return laws


# What a mill must keep: room for the balls, speeds of a mill


def distances(mill, surface, points, t):
    """Of points (times, n, 3) in the laboratory from a surface: (times, n), not positive where they cannot be."""
    pose = mill.pose(surface.motion, t)
    own = times(np.swapaxes(pose.rotation, -1, -2)[:, None], points - pose.place[:, None])
    own = (own - surface.place) @ surface.rotation
    distance = surface.shape.nearest(own)[0].min(axis=0)
    return np.where(surface.shape.covers(own), 0.0, distance)


def has_room(mill, largest, rng):
    """Whether whatever moves against something else leaves ROOM balls of `largest` m at all times."""
    solids = [s for s in mill.surfaces if is_solid(s) and s.shape.reach < 1]
    for count in (30, 400):  # a few looks first: most that fail fail at once
        t = np.concatenate([rng.uniform(0, 0.5, count), rng.uniform(0, 60, count)])
        for surface in solids:
            others = [s for s in mill.surfaces if s.motion != surface.motion]
            if not others:
                continue
            points = skin(rng, surface, count)
            pose = mill.pose(surface.motion, t)
            points = times(pose.rotation[:, None], points) + pose.place[:, None]
            for other in others:
                if distances(mill, other, points, t).min() < ROOM * largest:
                    return False
    return True


def is_solid(surface):
    shape = surface.shape
    far = np.array([[[10.0, 3.0, 7.0]]])
    outside = shape.nearest(far)[0].min() > 0 and not shape.covers(far).any()
    return outside and not isinstance(shape, Shaft)


def skin(rng, surface, count):
    """Points of the surface of a solid, in its motion's frame: what is nearest to points around, corners often."""
    around = rng.normal(size=(min(count, 60), 3))
    around *= 1.2 * surface.shape.reach / length(around)[:, None]
    distance, _, point = surface.shape.nearest(around)
    best = distance.argmin(axis=0)
    points = np.take_along_axis(point, best[None, :, None], 0)[0]
    return points @ surface.rotation.T + surface.place


def moves_well(mill):
    speeds = [mill.wall_speed(surface) for surface in mill.surfaces]
    return SLOWEST < max(speeds) < FASTEST


def holds_bodies(mill):
    """Whether no body has its middle out of the container; lifters of a drum have it in the wall."""
    container, *bodies = mill.surfaces
    middles = np.array([[middle_of(mill, body) for body in bodies]]).reshape(1, -1, 3)
    slack = 1e-6 if isinstance(container.shape, Drum) else 0.0
    return (distances(mill, container, middles, np.zeros(1)) > -slack).all()


def middle_of(mill, surface):
    """Where a surface's own origin is at t = 0."""
    pose = mill.pose(surface.motion, np.zeros(1))
    return pose.place[0] + pose.rotation[0] @ surface.place


def random_positions(rng, mill):
    """Ball centres anywhere free at t = 0, each APART from all that is there; None when there is no room."""
    container = mill.surfaces[0]
    middle = middle_of(mill, container)
    placed = np.zeros((0, 3))
    for _ in range(3000):
        trial = middle + rng.uniform(-1, 1, 3) * container.shape.reach
        radius = mill.radius[len(placed)]
        if len(placed):
            apart = length(placed - trial) - mill.radius[: len(placed)] - radius
            if apart.min() < APART:
                continue
        gaps = [distances(mill, s, trial[None, None], np.zeros(1)) for s in mill.surfaces]
        if min(gap.min() for gap in gaps) > radius + APART:
            placed = np.vstack([placed, trial])
            if len(placed) == len(mill.radius):
                return placed
    return None


def random_velocities(rng, mill, position):
    """Any velocities; where there are bodies most balls fly at one of them, often at an edge or a corner."""
    velocity = rng.normal(0, rng.uniform(0.5, 2), position.shape)
    bodies = [s for s in mill.surfaces[1:] if is_solid(s)]
    for ball, place in enumerate(position):
        if bodies and rng.random() < 0.8:
            body = bodies[int(rng.integers(len(bodies)))]
            pose = mill.pose(body.motion, np.zeros(1))
            spots = skin(rng, body, 60) @ pose.rotation[0].T + pose.place[0]
            near = length(spots - place).argsort()[:30]  # on this side of it
            way = spots[rng.choice(near)] - place
            velocity[ball] = rng.uniform(0.5, 3) * way / length(way)
    return velocity


def drawn(rng, seed):
    """Sections and files of a mill as the dice fall, and the size of its largest ball in mm."""
    index, family = divmod(seed, 5)
    if family == 4:
        sections, files = drum_sections_of(rng, index)
    elif family % 2:
        sections, files = tank_sections(rng, 2 * index + family // 2)
    else:
        sections, files = jar_sections(rng, 2 * index + family // 2)
    count = BALLS[index % len(BALLS)]
    # the widest ball that the container's middle holds, and a share of it
    first = {
        "balls": {"count": "1", "diameter": "1 mm", "density": "1 kg/m^3"},
        "contact": {"restitution": "1"},
    }
    mill = any_mill_of({**sections, **first}, files)
    container = mill.surfaces[0].shape
    origin = np.zeros((1, 3))
    if hasattr(container, "corners"):  # its file's origin may be anywhere
        origin = container.corners.reshape(-1, 3).mean(axis=0)[None]
    inner = container.nearest(origin)[0].min() * 1e3
    share = rng.uniform(0.25, 0.7) if family % 2 == 0 and family < 4 else rng.uniform(0.12, 0.25)
    largest = np.clip(inner * share, 3.0, 20.0)
    return sections, files, count, np.round(largest, 2)


def random_mill(seed):
    rng = np.random.default_rng([20250301, seed])
    while True:
        sections, files, count, largest = drawn(rng, seed)
        sections = {**random_gravity(rng, seed // 5 + 2 * seed), **sections}
        sections.update(random_balls(rng, count, largest))
        sections["balls"]["start"] = "start.txt"
        sections.update(random_laws(rng, sections, frictional=rng.random() < 0.75))
        sections["output"] = {"impacts": "all", "frames": "0 s"}
        mill = any_mill_of(sections, files)
        if not (moves_well(mill) and holds_bodies(mill) and has_room(mill, largest * 1e-3, rng)):
            continue
        position = random_positions(rng, mill)
        if position is not None:
            break
    columns = (9, 6, 9, 9, 3 if mill.gravity.any() else 6)[int(rng.integers(5))]
    velocity = random_velocities(rng, mill, position)
    velocity *= columns >= 6
    spin = rng.normal(0, 100, position.shape) * (columns == 9)
    return AnyCase(seed, sections, mill, position, velocity, spin, columns, files)
