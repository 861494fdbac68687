"""The kinds of contact, in the order in which files count them."""

KINDS = ("ball_ball", "ball_drum", "ball_wall", "ball_shaft", "ball_blade")
