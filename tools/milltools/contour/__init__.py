"""`mill contour`: the inner face of a liner from a drawing."""
