"""The 3D player of a run for web pages, and the other parts of the pages."""
