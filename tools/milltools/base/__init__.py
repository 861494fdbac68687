"""The ground floor: texts and numbers, files, progress, processes, the engine's program. It imports nothing of the
house."""
