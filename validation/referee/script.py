"""The input of LAMMPS for a deck: a region and a `fix wall/gran/region` for each surface, motions as variables.

LAMMPS is told the shapes and motions by this module, and the springs by `springs`. Nothing of this uses code of
millsim, which only reads the deck (units and defaults) and writes the start of the balls. What LAMMPS cannot do is
refused.
"""

import cmath
import dataclasses
import functools
import math

import numpy as np

POISSON = 0.3
AXES = "xyz"
CAP_MARGIN = 1e-9  # [m] by which a capsule's open cylinder is shorter: nothing is known of a ball exactly at the seam


class Refused(ValueError):
    """LAMMPS cannot do this deck."""


# ---- springs ----


@dataclasses.dataclass(frozen=True)
class Spring:
    """Of one kind of contact: stiffness [N/m] and reduced mass [kg]; the words of LAMMPS for its law."""

    stiffness: float
    mass: float
    words: str


def stiffness(modulus, speed, mass, radius):
    """[N/m] A linear spring that stores the energy of an impact at this speed at the depth at which Hertz' law does."""
    root, reduced = math.sqrt(radius), modulus / (2 * (1 - POISSON**2))
    return 16 / 15 * root * reduced * (15 * mass * speed**2 / (16 * root * reduced)) ** 0.2


def ends(damping):
    """(time, speed) at which the force of a damped impact is zero; mass, spring and speed of approach are 1."""
    w = math.sqrt(1 - damping**2)
    time = (math.pi - math.atan2(2 * damping * w, 1 - 2 * damping**2)) / w
    return time, -math.exp(-damping * time) * (math.cos(w * time) - damping / w * math.sin(w * time))


def swung(damping, time):
    """Slip after this time of a damped spring that without damping would swing half a cycle; slip before: 1."""
    w = cmath.sqrt((math.pi / time) ** 2 - damping**2) or 1e-9
    return (cmath.exp(-damping * time) * (cmath.cos(w * time) - damping / w * cmath.sin(w * time))).real


def solve(function, wanted, high):
    """The argument in 0 .. high at which a falling function has a value."""
    low = 0.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if function(middle) > wanted else (low, middle)
    return low


def limited(law, stiff, mass):
    """The law of soft millsim: no attraction. Normal and tangential dashpots are found from single impacts."""
    normal = solve(lambda z: ends(z)[1], law.restitution, 0.999)
    time = ends(normal)[0]
    along = solve(lambda z: -swung(z, time), law.tangential_restitution, 40.0)
    return (
        f"hooke {stiff:.17g} {2 * normal * math.sqrt(stiff / mass):.17g} tangential linear_history "
        f"{2 / 7 * (math.pi / time) ** 2 * stiff:.17g} {2 / 7 * along / normal:.17g} {law.friction:.17g} "
        "damping mass_velocity limit_damping"
    )


def attracting(law, stiff, mass):
    """LAMMPS' own law: the contact attracts at its end, as a damped spring does."""
    log, slow = math.log(law.restitution), math.log(law.tangential_restitution)
    square = stiff / mass / (1 + (log / math.pi) ** 2)
    return (
        f"hooke {stiff:.17g} {law.restitution:.17g} tangential linear_history "
        f"{2 / 7 * mass * square * (1 + (slow / math.pi) ** 2):.17g} {2 / 7 * slow / log:.17g} {law.friction:.17g} "
        "damping coeff_restitution"
    )


LAWS = {"limited": limited, "attracting": attracting}


# ---- motions ----


@dataclasses.dataclass(frozen=True)
class Course:
    """How a body moves: it turns by `angle` about the axis through `pivot`, which then moves by `shift`. Expressions of
    the time T, the same for LAMMPS and for Python; "0": not at all."""

    pivot: np.ndarray
    axis: np.ndarray
    angle: str = "0"
    shift: tuple = ("0", "0", "0")

    @functools.cached_property
    def values(self):
        """The function of the time T that has these four values."""
        return eval(f"lambda T: ({self.angle}, {', '.join(self.shift)})", {"sin": math.sin, "cos": math.cos})

    def at(self, time):
        """(angle [rad], shift [m])"""
        angle, *shift = self.values(time)
        return angle, np.array(shift)

    def moving(self, time, by=1e-6):
        """(place of the pivot [m], its velocity [m/s], angular velocity [rad/s], matrix): a point moves with the
        velocity plus (point - place) @ matrix."""
        (before, low), (after, high) = self.at(time - by), self.at(time + by)
        rate = (after - before) / (2 * by)
        return self.pivot + 0.5 * (low + high), (high - low) / (2 * by), rate * self.axis, rate * self.cross

    @functools.cached_property
    def cross(self):
        """The matrix by which the product with a vector is axis x vector."""
        return np.cross(self.axis, np.eye(3))

    def lines(self, name):
        """Variables of LAMMPS, and the words for a region that moves so."""
        lines, words = [], ""
        if any(each != "0" for each in self.shift):
            moves = []
            for letter, each in zip(AXES, self.shift):
                moves.append("NULL" if each == "0" else f"v_{name}{letter}")
                if each != "0":
                    lines.append(f"variable {name}{letter} equal {each.replace('T', '(step*dt)')}")
            words += f" move {' '.join(moves)}"
        if self.angle != "0":
            lines.append(f"variable {name}turn equal {self.angle.replace('T', '(step*dt)')}")
            words += f" rotate v_{name}turn {vector(self.pivot)} {vector(self.axis)}"
        return lines, words


def vector(values):
    return " ".join(f"{v:.17g}" for v in values)


def along(axis):
    """Index of the axis of the laboratory with which a direction agrees."""
    axis = np.array(axis) / np.linalg.norm(axis)
    if np.abs(axis).max() < 1 - 1e-12:
        raise Refused("an axis that is none of x, y, z")
    return int(np.abs(axis).argmax())


def turning(deck, name):
    """(point of the axis, direction, angle as expression) of a motion that turns or swings; None of a shift."""
    section = "rotor" if name == "rotor" else f"motion.{name}"
    kind = deck.value(f"{section}.kind", "turn")
    if kind == "shift":
        return None
    if deck.number(f"{section}.angle", 0.0) or deck.number(f"{section}.phase", 0.0):
        raise Refused(f"{name}: turned at the start")
    axis = np.array(deck.numbers(f"{section}.axis") or [1.0, 0.0, 0.0])
    axis[np.arange(3) != along(axis)] = 0.0
    axis = axis / np.linalg.norm(axis)  # LAMMPS multiplies the speed of the surface by the length of the axis
    through = np.array(deck.numbers(f"{section}.centre") or [0.0, 0.0, 0.0])
    if kind == "turn":
        return through, axis, f"({deck.number(f'{section}.speed'):.17g})*T"
    amplitude, frequency = (deck.number(f"{section}.{key}") for key in ("amplitude", "frequency"))
    return through, axis, f"{amplitude:.17g}*sin({2 * math.pi * frequency:.17g}*T)"


def shifts(deck, name):
    """The shift as expressions, and its value at the start [m]."""
    amplitude, phase = (deck.numbers(f"motion.{name}.{key}") for key in ("amplitude", "phase"))
    rate = 2 * math.pi * deck.number(f"motion.{name}.frequency")
    start = np.array(amplitude) * np.sin(phase)
    words = [
        f"{a:.17g}*sin({rate:.17g}*T+{p:.17g})-({s:.17g})" if a else "0" for a, p, s in zip(amplitude, phase, start)
    ]
    return tuple(words), start


def course(deck, name):
    """(Course of what the motion `name` ("": none) carries, its shift at the start [m])"""
    zero = np.zeros(3)
    if not name:
        return Course(zero, zero), zero
    own, on = turning(deck, name), deck.value(f"motion.{name}.on", "")
    if own is None:
        if on:
            raise Refused("a shift on another motion")
        words, start = shifts(deck, name)
        return Course(zero, zero, shift=words), start
    pivot, axis, angle = own
    outer = turning(deck, on) if on else None
    if not on:
        return Course(pivot, axis, angle), zero
    if outer is None or deck.value(f"motion.{on}.on", "") or np.abs(outer[1]) @ np.abs(axis) < 1:
        raise Refused("a chain of motions other than two turns about parallel axes")
    arm = pivot - outer[0]
    arm = arm - (arm @ axis) * axis
    ahead = np.cross(outer[1], arm)
    words = [
        f"({a:.17g})*(cos({outer[2]})-1)+({b:.17g})*sin({outer[2]})" if a or b else "0" for a, b in zip(arm, ahead)
    ]
    total = f"{angle}+{'-' if outer[1] @ axis < 0 else ''}{outer[2]}"
    return Course(pivot, axis, total, tuple(words)), zero


# ---- surfaces ----


@dataclasses.dataclass
class Wall:
    """A region: its name, LAMMPS' words, its kind of contact, what moves it. `group`: only these balls meet it."""

    name: str
    words: str
    kind: str
    course: Course
    holds: bool  # it belongs to the container
    lines: tuple = ()  # regions it is made of
    group: str = "all"


def cylinder(centre, axis, radius, length, options=""):
    a = along(axis)
    across = [c for k, c in enumerate(centre) if k != a]
    low, high = centre[a] - length / 2, centre[a] + length / 2
    return f"cylinder {AXES[a]} {vector(across)} {radius:.17g} {low:.17g} {high:.17g}{options}"


def body_walls(deck, name):
    """The Walls of [body.NAME]"""
    section = f"body.{name}"
    shape, kind = deck.value(f"{section}.shape"), deck.kind_of(name)
    if deck.number(f"{section}.rounding", 0.0) or deck.count(f"{section}.copies") > 1:
        raise Refused(f"{name}: rounded, or in copies")
    course_, start = course(deck, deck.value(f"{section}.motion", ""))
    centre = np.array(deck.numbers(f"{section}.centre") or [0.0] * 3) + start
    holds = deck.value(f"{section}.side", "outside") == "inside"
    side = "" if holds else " side out"
    axis = deck.numbers(f"{section}.axis") or [0.0, 0.0, 1.0]
    radius, length = (deck.number(f"{section}.{key}", 0.0) for key in ("radius", "length"))
    if shape == "sphere":
        words = [(name, f"sphere {vector(centre)} {radius:.17g}", "all")]
    elif shape == "cylinder":
        words = [(name, cylinder(centre, axis, radius, length), "all")]
    elif shape == "box" and axis == [0.0, 0.0, 1.0] and not deck.number(f"{section}.angle", 0.0):
        half = np.array(deck.numbers(f"{section}.size")) / 2
        words = [(name, f"block {vector(np.stack([centre - half, centre + half], axis=1).ravel())}", "all")]
    elif shape == "capsule" and holds:
        end = np.eye(3)[along(axis)] * length / 2
        words = [(name, cylinder(centre, axis, radius, length - 2 * CAP_MARGIN, " open 1 open 2"), "all")]
        words += [
            (f"{name}{k}", f"sphere {vector(centre + s * end)} {radius:.17g}", f"cap{k}") for k, s in ((0, -1), (1, 1))
        ]
    else:
        raise Refused(f"{name}: {shape}")
    return [Wall(own, region + side, kind, course_, holds, group=group) for own, region, group in words]


def wavy(deck):
    """The wall of a wavy drum at rest: a core, united with the outer arcs, without the inner arcs. Regions overlap."""
    radius, height, length = (deck.number(f"drum.{key}") for key in ("radius", "buckle_height", "length"))
    count, a = deck.count("drum.buckles"), 1 - math.cos(math.pi / deck.count("drum.buckles"))
    b, c = 4 * height, 2 * height**2 - a * radius**2
    offset = (-b + math.sqrt(b * b - 4 * a * c)) / (2 * a)
    rho, near, far, step = offset + height, radius - offset, radius + offset, math.pi / count
    meet = 0.5 * np.array([near + far * math.cos(step), far * math.sin(step)])  # arcs join in the middle of the centres
    lines, names = [f"region core {cylinder([0, 0, 0], [1, 0, 0], math.hypot(*meet), 2 * length)} units box"], ["core"]
    for k in range(2 * count):
        at, angle = (far if k % 2 else near), deck.number("drum.buckle_angle", 0.0) + k * step
        centre = [0.0, at * math.cos(angle), at * math.sin(angle)]
        side = " side out" if k % 2 else ""
        lines.append(f"region arc{k} {cylinder(centre, [1, 0, 0], rho, 2 * length)}{side} units box")
        names += [] if k % 2 else [f"arc{k}"]
    lines.append(f"region bulges union {len(names)} {' '.join(names)}")
    inner = [f"arc{k}" for k in range(1, 2 * count, 2)]
    return lines, f"intersect {count + 1} bulges {' '.join(inner)}"


def drum_walls(deck):
    """The Walls of a drum at rest and of its rotor."""
    if deck.value("drum.motion", "") or deck.periodic or deck.number("rotor.angle", 0.0):
        raise Refused("a drum that moves or is periodic, or a rotor that is turned at the start")
    still, zero = course(deck, "")[0], np.zeros(3)
    radius, length = deck.number("drum.radius"), deck.number("drum.length")
    if deck.value("drum.profile", "circle") == "wavy":
        lines, words = wavy(deck)
        found = [Wall("drum", words, "ball_drum", still, True, tuple(lines))]
        found.append(Wall("ends", f"xplane {-length / 2:.17g} {length / 2:.17g}", "ball_wall", still, True))
    else:
        found = [Wall("drum", cylinder(zero, [1, 0, 0], radius, length), "ball_drum", still, True)]
    turns = course(deck, "rotor")[0] if "rotor" in deck.sections else still
    if deck.shaft_radius:
        words = cylinder(zero, [1, 0, 0], deck.shaft_radius, 2 * length, " side out")
        found.append(Wall("shaft", words, "ball_shaft", turns, False))
    for k, blade in enumerate(deck.blades):
        if math.sin(blade.angle / 2) > 1e-12 or blade.pitch:
            raise Refused("a blade that is turned at the start")
        corners = [blade.position - blade.width / 2, blade.position + blade.width / 2, 0.0, blade.tip_radius]
        words = f"block {vector([*corners, -blade.thickness / 2, blade.thickness / 2])} side out"
        found.append(Wall(f"blade{k}", words, "ball_blade", turns, False))
    return found


# ---- the whole ----


@dataclasses.dataclass
class Input:
    """`lines` of LAMMPS up to the first step; `walls`; `pair`: Spring of two balls; mass [kg], radius [m] of a ball."""

    lines: list
    walls: list
    pair: Spring
    mass: float
    radius: float
    step: float


def write(deck, start, modulus, speed, step, law="limited"):
    """The Input for a Deck and the start of the balls: place, velocity, spin (N, 3). modulus [Pa]; speed [m/s] at which
    springs are as stiff as Hertz' law; step [s]."""
    if len(deck.species) > 1 or "restitution_speed" in deck.text or "restitution_table" in deck.text:
        raise Refused("several species, or a restitution that depends on the speed")
    ball = deck.species[0]
    radius, count = ball.diameter / 2, len(start[0])
    walls = drum_walls(deck) if "drum" in deck.sections else []
    walls += [wall for name in deck.bodies for wall in body_walls(deck, name)]

    def spring(kind, mass, size):
        stiff = stiffness(modulus, speed, mass, size)
        return Spring(stiff, mass, LAWS[law](deck.contact(kind), stiff, mass))

    pair = spring("ball_ball", ball.mass / 2, radius / 2)
    low, high = bounds(deck, start, walls)
    gravity = np.array(deck.numbers("gravity.acceleration"))
    pull = np.linalg.norm(gravity)
    lines = [
        "units si", "atom_style sphere", "boundary f f f", "newton off", "comm_modify vel yes",
        "atom_modify map array sort 0 0", f"neighbor {0.3 * radius:.9g} {'nsq' if count < 60 else 'bin'}",
        "neigh_modify delay 0 every 1 check yes",
        f"region box block {vector(np.stack([low, high], axis=1).ravel())} units box", "create_box 1 box",
        "pair_style granular", f"pair_coeff * * {pair.words}", f"timestep {step:.17g}",
    ]  # fmt: skip
    for k, place in enumerate(start[0]):
        lines.append(f"create_atoms 1 single {vector(place)} units box")
        lines.append(f"set atom {k + 1} diameter {ball.diameter:.17g} density {ball.density:.17g}")
        velocity = " ".join(f"v{letter} {value:.17g}" for letter, value in zip(AXES, start[1][k]))
        lines.append(f"set atom {k + 1} {velocity} omega {vector(start[2][k])}")
    lines += [f"group {wall.group} empty" for wall in walls if wall.group != "all"]
    for wall in walls:
        variables, moves = wall.course.lines(wall.name)
        words = spring(wall.kind, ball.mass, radius).words
        fix = f"fix {wall.name} {wall.group} wall/gran/region granular {words}"
        lines += [*variables, *wall.lines]
        if wall.words.startswith("xplane"):
            lines.append(f"{fix.replace('/region', '')} {wall.words}")
        else:
            plain = wall.words.startswith("intersect")
            lines += [f"region {wall.name} {wall.words}{'' if plain else ' units box'}{moves}"]
            lines.append(f"{fix} region {wall.name}{'' if plain else ' contacts'}")
    if pull > 0:
        lines.append(f"fix weight all gravity {pull:.17g} vector {vector(gravity / pull)}")
    lines += ["fix move all nve/sphere", "thermo 1000000000", "thermo_modify lost error norm no", "run 0"]
    return Input(lines, walls, pair, ball.mass, radius, step)


def bounds(deck, start, walls):
    """A box (low, high) [m] that no ball leaves: the container's size around all places on its way."""
    whole = [deck.number(f"body.{name}.{key}", 0.0) for name in deck.bodies for key in ("radius", "length")]
    reach = sum(whole[:2]) + deck.number("drum.radius", 0.0) + deck.number("drum.buckle_height", 0.0)
    carrier = next(wall.course for wall in walls if wall.holds)
    middle, places = start[0].mean(axis=0), []
    for time in np.linspace(0, 2, 4001):
        angle, shift = carrier.at(time)
        arm = middle - carrier.pivot
        turned = arm * math.cos(angle) + np.cross(carrier.axis, arm) * math.sin(angle)
        turned += carrier.axis * (carrier.axis @ arm) * (1 - math.cos(angle))
        places.append(carrier.pivot + shift + (turned if carrier.axis.any() else arm))
    return np.min(places, axis=0) - 2 * reach, np.max(places, axis=0) + 2 * reach
