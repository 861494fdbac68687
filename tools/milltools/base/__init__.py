"""The lowest layer: texts and numbers, files, progress, processes, the program millsim. It imports no other package of
milltools."""
