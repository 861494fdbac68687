"""What goes wrong for reasons that a user can correct."""


class MillsimError(Exception):
    """One line for the user: what, where, and what to do. `status` is the exit status that the command ends with: 2 for
    wrong usage or input, and then this is an InputError; 1 for a failure outside (disk full, a program that is
    missing)."""

    def __init__(self, text: object, status: int = 2) -> None:
        super().__init__(" ".join(str(text).split()))
        self.status = status
        if type(self) is MillsimError and status == 2:
            self.__class__ = InputError

    def __reduce__(self) -> tuple[object, ...]:  # to another process, with its status
        return type(self), (str(self), self.status)


class InputError(MillsimError, ValueError):
    """A wrong deck, wrong usage, a damaged file: also a ValueError."""


class MissingFileError(InputError, FileNotFoundError):
    """A file that is not there: also a FileNotFoundError."""


UserError = MillsimError  # the name that the house raises, and that scripts of earlier versions catch
