"""What goes wrong for reasons a user can mend."""

import os


class UserError(Exception):
    """One line for the user: what, where, and the mend. The command prints it and ends with `status`:
    2 for wrong usage or input (the default), 1 for a failure outside (disk full, a program that is missing)."""

    def __init__(self, text: str, status: int = 2):
        super().__init__(" ".join(str(text).split()))
        self.status = status


def keep_apart(output, sources):
    """UserError where what is to be written is one of the files it comes from, by whatever name."""
    for source in sources:
        if os.path.exists(output) and os.path.exists(source) and os.path.samefile(output, source):
            raise UserError(f"{output}: is {source} itself; give another name")
