"""Geometry of a run: the bodies of the mill as triangles, outlines, and the balls at any time."""
