"""Checks of the file of a table: checksums of lines of JSON, and the names and types of metadata and
rows."""

import hashlib
import json
import math
import re
import shlex

import numpy as np
import pyarrow
from pyarrow import compute

STATUSES = ("done", "capped", "failed")
SUM = re.compile(rb'(\{.*), "sum": "([0-9a-f]{16})"\}', re.S)
SECRETS = re.compile(r"(\w://[^:/@]*:).*(?=@)|([?&][^=&]*(?:pass|pwd|secret|token)[^=&]*=)[^&]*", re.I | re.S)
NONE = type(None)
META = {
    "study": str, "file": str, "deck": str, "fingerprint": str, "common": dict, "objectives": list, "record": list,
    "require": list, "notes": list, "vary": list, "method": str, "samples": (int, NONE), "seed": int, "replicates": int,
    "planned": (int, NONE), "command": str, "version": str, "derived": list, "rules": list, "known": dict,
}  # fmt: skip
OBJECTIVE = {"path": str, "goal": str, "unit": (str, NONE), "description": (str, NONE)}
VARY = {
    "key": str, "unit": (str, NONE), "meaning": (str, NONE), "kind": str, "whole": bool, "log": bool,
    "low": (int, float, NONE), "high": (int, float, NONE), "values": (list, NONE), "choices": list, "written": str,
}  # fmt: skip
DERIVED = {"key": str, "text": str, "unit": str, "kind": str, "meaning": str}
OF_KIND = {"number": (int, float), "whole": int, "choice": str, "vector": str, "file": str}


def hidden(address: str) -> str:
    """An address for --storage, without its passwords."""
    return SECRETS.sub(lambda found: f"{found[1] or found[2]}***", address)


def hidden_command(line: str) -> str:
    """A command line without the passwords of its addresses."""
    try:
        words = shlex.split(line)
    except ValueError:
        words = [line]
    shown = [hidden(word) for word in words]
    return line if shown == words else shlex.join(shown)


# ---- lines of JSON


def plain(row: dict) -> dict:
    """A row for JSON: unknown values are null."""
    return {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in row.items()}


def seal(values: dict) -> bytes:
    """One line of JSON that ends with a checksum of the text before it."""
    text = json.dumps(values, ensure_ascii=False, allow_nan=False).encode()[:-1]
    return text + f', "sum": "{_sum(text)}"}}'.encode()


def unseal(line: bytes) -> tuple[dict, bool]:
    """The values of a line, and whether it has a checksum. ValueError where it is damaged."""
    found = SUM.fullmatch(line)
    if found and _sum(found[1]) != found[2].decode():
        raise ValueError("its checksum does not match")
    try:
        values = json.loads(found[1] + b"}" if found else line, parse_constant=_refused)
    except RecursionError:
        raise ValueError("nested too deeply") from None
    if not isinstance(values, dict):
        raise ValueError("no JSON object")
    return values, bool(found)


def _sum(text: bytes) -> str:
    return hashlib.sha256(text).hexdigest()[:16]


def _refused(word):
    raise ValueError(f"{word} is not a number")


# ---- metadata


def check_metadata(meta: dict, known_only: bool):
    """ValueError if the metadata of a table have wrong types; with `known_only` also if there are unknown
    names."""
    _check_kinds(meta, META, ("objectives", "record", "vary"), known_only)
    for one in meta["objectives"]:
        _check_kinds(one, OBJECTIVE, ("path", "goal"), known_only)
        if one["goal"] not in ("maximise", "minimise"):
            raise ValueError(f"the goal '{one['goal'][:40]}' is unknown")
    for one in meta["vary"]:
        _check_kinds(one, VARY, ("key", "kind"), known_only)
        _check_vary(one)
    for one in meta.get("derived", ()):
        _check_kinds(one, DERIVED, DERIVED, known_only)
    known = meta.get("known", {}).values()
    if not all(isinstance(one, list) and len(one) == 2 and all(isinstance(x, str) for x in one) for one in known):
        raise ValueError("'known' contains values that are no pairs of texts")
    if not meta["objectives"] or not meta["vary"]:
        raise ValueError("it has no varied key or no objective")
    if not all(
        isinstance(text, str)
        for text in [
            *meta["record"],
            *meta.get("require", []),
            *meta.get("notes", []),
            *meta.get("rules", []),
            *meta.get("common", {}).values(),
        ]
    ):
        raise ValueError("'record', 'require', 'notes', 'rules' or 'common' contains values that are not texts")


def _check_kinds(values, kinds, needed, known_only):
    if not isinstance(values, dict):
        raise ValueError(f"expected {' and '.join(needed)}, got a {type(values).__name__}")
    for name in needed:
        if name not in values:
            raise ValueError(f"'{name}' is missing")
    for name, value in values.items():
        if name not in kinds:
            if known_only:
                raise ValueError(f"'{name[:40]}' is unknown")
        elif not isinstance(value, kinds[name]) or (isinstance(value, bool) and kinds[name] is not bool):
            raise ValueError(f"'{name}' is a {type(value).__name__}")


def _check_vary(one):
    kind = OF_KIND.get(one["kind"])
    if kind is None:
        raise ValueError(f"the kind '{one['kind'][:40]}' of {one['key'][:80]} is unknown")
    values, ends = one.get("values"), (one.get("low"), one.get("high"))
    said = [*(values or ()), *(end for end in ends if end is not None)]
    good = all(isinstance(value, kind) and not isinstance(value, bool) for value in said)
    good = good and all(abs(value) < math.inf for value in said if kind is not str)
    if not good or values == [] or (values is None and (kind is str or None in ends or ends[0] > ends[1])):
        raise ValueError(f"{one['key'][:80]} has no valid values")


# ---- rows


def wrong_rows(table: pyarrow.Table, keys: list[dict]) -> np.ndarray:
    """Marks the rows that cannot belong to a study of these keys: wrong id or status, missing or infinite numbers."""
    finite = {"cpu", "wall", *(one["key"] for one in keys)}
    good = [
        compute.is_in(table["status"], pyarrow.array(STATUSES)),
        compute.match_substring_regex(table["id"], r"^[0-9a-f]{16}$"),
        *(compute.greater_equal(table[name], 0) for name in ("design", "replicate", "seed", "collisions")),
    ]
    for field in table.schema:
        column = table[field.name]
        if not pyarrow.types.is_floating(field.type):
            good.append(column.is_valid())
        elif field.name in finite:
            good.append(compute.is_finite(column))
        else:
            good.append(compute.invert(compute.is_inf(column).fill_null(False)))
    return ~np.logical_and.reduce([one.fill_null(False).to_numpy().astype(bool) for one in good])


def content(table: pyarrow.Table) -> str:
    """A checksum of all values in the columns."""
    total = hashlib.sha256()
    for name in table.schema.names:
        column = table[name]
        total.update(json.dumps(name).encode())
        if pyarrow.types.is_string(column.type):
            total.update(json.dumps(column.to_pylist()).encode())
        else:
            values = column.to_numpy()
            values = np.where(np.isnan(values), np.nan, values) if values.dtype.kind == "f" else values
            total.update(values.astype(values.dtype.newbyteorder("<")).tobytes())
    return total.hexdigest()[:16]
