"""What a command of `mill` prints on standard output: text for people or, with --json, one JSON object for programs."""

import dataclasses
import json
import math
from collections.abc import Callable
from typing import Any


@dataclasses.dataclass(frozen=True)
class Answer:
    """`text`: lines, or a function that prints them. `facts`: the members of the JSON object, in SI units, or a
    function that gives them; numbers of numpy and paths are allowed. Programs rely on the names. `status`: the exit
    status."""

    text: str | Callable[[], object]
    facts: dict[str, Any] | Callable[[], dict[str, Any]]
    status: int = 0

    def show(self, command: str, as_json: bool) -> None:
        if as_json:
            facts = self.facts() if callable(self.facts) else self.facts
            print(json.dumps(for_json({"command": command} | facts), allow_nan=False))
        elif callable(self.text):
            self.text()
        else:
            print(self.text)


def for_json(value: Any) -> Any:
    """A value as JSON can hold it: a number that is not finite (not known, or without a limit) is null."""
    if isinstance(value, dict):
        return {str(name): for_json(item) for name, item in value.items()}
    if hasattr(value, "tolist"):  # of numpy
        return for_json(value.tolist())
    if isinstance(value, list | tuple):
        return [for_json(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value if value is None or isinstance(value, str | int | float) else str(value)
