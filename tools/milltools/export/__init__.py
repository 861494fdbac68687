"""Export of runs and decks to the formats of other programs."""
