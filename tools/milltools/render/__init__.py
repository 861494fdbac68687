"""Pictures of a run in 3D."""
