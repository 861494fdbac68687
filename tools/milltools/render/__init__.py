"""Pictures and films of a run in 3D, off-screen."""
