"""A deck as soft spheres in LIGGGHTS."""
