"""What a deck and an output file say."""
