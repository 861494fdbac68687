#!/usr/bin/env python3
"""Writes a mesh for millsim: `examples/rotor_mesh.py input/rotor.stl` makes the stirrer of input/stl.ini again, to the
same bytes.

A hub with three stages of four paddles that wind around it, in mm, its axis along z. In every cross-section the
outline is one radius for each direction, so the surface is closed and does not cross itself. Paddles are slabs with
rounded ends that run out into the hub.
"""

import math
import struct
import sys

HUB, TIP, THICK = 9.0, 40.0, 6.0  # [mm] radii, thickness of a paddle
LOW, HIGH = -34.0, 30.0  # [mm] of the hub
STAGES, ARMS, TURNS = 3, 4, 0.55  # of the helix from end to end
STAGE, EDGE = 15.0, 4.0  # [mm] length of a paddle along the axis; length over which each of its ends tapers into the hub
AROUND, STEPS = 15, 11  # corners of an arm's outline; rings of a stage


def outline(angle, share):
    """Radius at an angle from the middle of an arm that reaches so much of its length."""
    tip = HUB + (TIP - HUB) * share
    side = abs(math.sin(angle)) / (0.5 * THICK)
    arm = (tip**-8 + side**8) ** -0.125
    return (HUB**8 + arm**8) ** 0.125 if share > 0 else HUB


def angles():
    """From the middle of one arm to that of the next, corner by corner at equal distances along the outline."""
    fine = [2 * math.pi / ARMS * (k / 4000 - 0.5) for k in range(4001)]
    place = [(outline(a, 1.0) * math.cos(a), outline(a, 1.0) * math.sin(a)) for a in fine]
    way = [0.0]
    for one, other in zip(place, place[1:]):
        way.append(way[-1] + math.dist(one, other))
    found, at = [], 0
    for k in range(AROUND):
        while way[at] < way[-1] * k / AROUND:
            at += 1
        found.append(fine[at])
    return found


def heights():
    """Rings from end to end: (z, share of the paddles' length there)"""
    rings = [(LOW, 0.0)]
    room = (HIGH - LOW - STAGES * STAGE) / STAGES
    for stage in range(STAGES):
        start = LOW + room / 2 + stage * (STAGE + room)
        for k in range(STEPS):
            z = STAGE * 0.5 * (1.0 - math.cos(math.pi * k / (STEPS - 1)))
            inward = min(z, STAGE - z) / EDGE
            share = math.sqrt(1.0 - (1.0 - min(inward, 1.0)) ** 2)
            rings.append((start + z, share))
    rings.append((HIGH, 0.0))
    return rings


def facets():
    arm = angles()
    around = [2 * math.pi / ARMS * n + a for n in range(ARMS) for a in arm]
    rings = []
    for z, share in heights():
        turn = 2 * math.pi * TURNS * (z - LOW) / (HIGH - LOW)
        radii = [outline(a, share) for a in arm] * ARMS
        rings.append([(r * math.cos(a + turn), r * math.sin(a + turn), z) for r, a in zip(radii, around)])
    n = len(around)
    for low, high in zip(rings, rings[1:]):
        for k in range(n):
            a, b, c, d = low[k], low[(k + 1) % n], high[(k + 1) % n], high[k]
            yield from (((a, b, c), (a, c, d)) if math.dist(a, c) < math.dist(b, d) else ((a, b, d), (b, c, d)))
    for ring, z, turned in ((rings[0], LOW, True), (rings[-1], HIGH, False)):
        for k in range(n):
            a, b = ring[k], ring[(k + 1) % n]
            yield ((0.0, 0.0, z), b, a) if turned else ((0.0, 0.0, z), a, b)


def main():
    made = list(facets())
    with open(sys.argv[1], "wb") as file:
        file.write(b"stirrer, in mm: tools/rotor_mesh.py".ljust(80) + struct.pack("<I", len(made)))
        for facet in made:
            # the normal may be left to the reader
            file.write(struct.pack("<12fH", 0.0, 0.0, 0.0, *(x for corner in facet for x in corner), 0))


if __name__ == "__main__":
    main()
