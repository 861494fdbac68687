"""Where things are: the mill's bodies as triangles, its outlines, the balls at any time."""
