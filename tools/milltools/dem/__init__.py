"""Runs a deck as soft spheres in LIGGGHTS."""

from milltools.base.extras import needs

needs("dem")
