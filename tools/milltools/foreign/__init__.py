"""Runs of other programs as files of millsim's own schema: see milltools.foreign.digest."""
