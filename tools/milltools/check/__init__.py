"""`mill check`: do hard spheres hold for a mill? The same deck is run with soft spheres, from the same starts."""
