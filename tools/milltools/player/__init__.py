"""The balls of a run in 3D in a browser, and the figures beside them."""
