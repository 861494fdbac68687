"""Which design to run next."""
