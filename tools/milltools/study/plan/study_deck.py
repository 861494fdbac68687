"""The study deck: what is varied, over which base deck, and what is wanted.

    study = Study.read("input/figure7.study", ["study.replicates=3"])
    job = study.job(0, {"drum.buckles": 5, "drum.buckle_height": 0.004})        # -> job.run(job)

docs/studies.md lists the keys. Every mistake is a UserError that names file, line and key.
"""

import dataclasses
import functools
import hashlib
import json
import pathlib
import re

from milltools.base import engine
from milltools.base.errors import UserError
from milltools.read import deck_text as lines
from milltools.read.values import Value, order, tell
from milltools.study.plan import ranges

ROW_VERSION = 1  # of what a row holds: another one is another run
SEEDS = 2**32
METHODS = ("grid", "lhs", "sobol", "saltelli")
KEYS = ("deck", "maximise", "minimise", "record", "replicates", "seed", "seeds", "precision", "max_collisions",
        "cpu_limit", "method", "samples")  # fmt: skip
# what a run stores beside its statistics: it does not decide them
STORED_ONLY = ("output.frames", "output.series", "output.checkpoint", "output.impacts")
PATH = re.compile(r"[A-Za-z0-9_]+(/[A-Za-z0-9_]+)*$")


@dataclasses.dataclass(frozen=True)
class Objective:
    """A scalar of /statistics that is to be large or small."""

    path: str  # below /statistics
    goal: str  # "maximise" or "minimise"
    unit: str = ""
    description: str = ""

    @property
    def sign(self) -> int:
        """+1: larger is better; -1: smaller."""
        return 1 if self.goal == "maximise" else -1


@dataclasses.dataclass
class Study:
    """A study deck as read. Values are in SI."""

    file: str
    text: str
    deck: str  # absolute path of the base deck
    deck_text: str
    start: str  # digest of its start file; "" for a random start
    objectives: list[Objective]
    record: list[str]
    replicates: int
    seed: int
    seeds: str  # "shared" or "own"
    limit: float | None  # [s] CPU time of one run
    method: str
    samples: int | None
    base: dict[str, Value]  # all keys that the base deck and [set] give, by section.key
    fixed: list[Value]  # of these the ones that override the base deck
    vary: list[ranges.Range]
    places: dict[str, lines.Entry]  # where each key of [study] and each varied key stands

    # ---- reading

    @classmethod
    def read(cls, path, overrides=()) -> "Study":
        """Reads a study deck. An override is "study.KEY=VALUE", "vary.SECTION.KEY=RANGE" or, for [set],
        "SECTION.KEY=VALUE"."""
        path = pathlib.Path(path)
        text = lines.read_text(path)
        return _Reader(path, text, overrides).study()

    # ---- runs

    @property
    def paths(self) -> list[str]:
        """All scalars that a row holds: objectives first."""
        return [*(objective.path for objective in self.objectives), *self.record]

    def paths_of(self, key) -> list[str]:
        """Those of `maximise`, `minimise` or `record`."""
        if key == "record":
            return self.record
        return [objective.path for objective in self.objectives if objective.goal == key]

    def fault(self, key, text) -> UserError:
        """About a key of [study] or a varied key, with file and line."""
        return self.places[key].fault(text)

    def seed_of(self, design: int, replicate: int) -> int:
        """The seed of a run: with shared ones (common random numbers) that of its replicate alone."""
        own = design * self.replicates if self.seeds == "own" else 0
        return (self.seed + own + replicate) % SEEDS

    def job(self, design: int, values: dict, replicate: int = 0) -> dict:
        """One run as job.run takes it: JSON-able, all that is needed to run it on another machine."""
        seed = self.seed_of(design, replicate)
        chosen = {key: (self._text(r, values[key]), r.unit) for key, r in self._ranges.items()}
        chosen["run.seed"] = (str(seed), "1")
        orders = [value.order for value in self.fixed]
        orders += [order(key, text, unit) for key, (text, unit) in chosen.items()]
        return {
            "deck": self.deck,
            "text": self.deck_text,
            "set": orders,
            "values": dict(values),
            "design": int(design),
            "replicate": int(replicate),
            "seed": seed,
            "id": self._identity({key: text for key, (text, _) in chosen.items()}),
            "objectives": [objective.path for objective in self.objectives],
            "record": list(self.record),
            "limit": self.limit,
            "program": self._program,
        }

    def _text(self, r, value) -> str:
        """The shortest text that reads back to the same number; a file by its whole name."""
        if r.kind == "file" and value != "random":
            return str((pathlib.Path(self.deck).parent / value).resolve())
        return repr(float(value)) if isinstance(value, float) else str(value)

    @functools.cached_property
    def _program(self):
        return str(engine.program().resolve())

    @functools.cached_property
    def _ranges(self):
        return {r.key: r for r in self.vary}

    @functools.cached_property
    def _shared(self):
        """What all runs have in common, as texts: keys in SI, and the rest."""
        keys = {k: v.text for k, v in self.base.items() if k not in STORED_ONLY}
        sections = dict.fromkeys(k.rpartition(".")[0] for k in self.base)
        named = [name for name in sections if "." in name]  # their order numbers the balls
        return keys, [ROW_VERSION, named, self.start, sorted(self.paths), self.limit]

    def _identity(self, chosen: dict) -> str:
        """16 hex digits of everything that decides a run and its row: all keys in SI however they were written and
        wherever they stood, the start file, what is read from the run."""
        keys, rest = self._shared
        whole = [*rest, sorted((keys | chosen).items())]
        return hashlib.sha256(json.dumps(whole).encode()).hexdigest()[:16]

    @property
    def fingerprint(self) -> str:
        """16 hex digits of what all runs have in common: rows of equal fingerprints belong into one table."""
        return self._identity(dict.fromkeys([*self._ranges, "run.seed"], "varied"))

    def common(self) -> dict[str, str]:
        """What the fingerprint is made of, for people: by section.key, or by what else it is."""
        keys = {k: v.order.partition("=")[2] for k, v in self.base.items() if k not in STORED_ONLY}
        keys |= dict.fromkeys([*self._ranges, "run.seed"], "varied")
        rest = {"the start file": self.start and f"one with digest {self.start[:8]}",
                "what is recorded": ", ".join(sorted(self.paths)),
                "study.cpu_limit": "" if self.limit is None else f"{self.limit!r} s"}  # fmt: skip
        return keys | {k: v for k, v in rest.items() if v}

    def about(self, planned=None, command="") -> dict:
        """The metadata of the table."""
        return {
            "study": self.text,
            "file": self.file,
            "deck": self.deck_text,
            "fingerprint": self.fingerprint,
            "common": self.common(),
            "objectives": [dataclasses.asdict(objective) for objective in self.objectives],
            "record": list(self.record),
            "vary": [r.about() for r in self.vary],
            "method": self.method,
            "samples": self.samples,
            "seed": self.seed,
            "replicates": self.replicates,
            "planned": planned,
            "command": command,
            "version": engine.version(),
        }


class _Reader:
    """Reads one study deck; the first thing that is wrong ends it."""

    def __init__(self, path, text, overrides):
        self.path, self.text = path, text
        found = lines.entries(text, path)
        for entry in found:
            if entry.section not in ("study", "set", "vary"):
                raise UserError(f"{entry.where}: [{entry.section}]: unknown section; there are [study], [set] and [vary]")  # fmt: skip
        self.entries = {(entry.section, entry.key): entry for entry in found}
        for text in overrides:
            self._override(text)
        for (section, key), entry in self.entries.items():
            if section == "study" and key not in KEYS:
                raise entry.fault(f"unknown key; there are {', '.join(KEYS)}")

    def _override(self, text):
        name, equals, value = text.partition("=")
        name = name.strip()
        if not equals or "." not in name:
            raise UserError(f"--set {text}: expected study.KEY=VALUE, vary.SECTION.KEY=RANGE or SECTION.KEY=VALUE")
        section, _, key = name.partition(".")
        if section not in ("study", "vary"):
            section, key = "set", name
        self.entries[section, key] = lines.Entry(section, key, value.strip(), f"--set {text}")
        # what is fixed is not varied any more, and the other way round
        if section != "study":
            self.entries.pop(("vary" if section == "set" else "set", key), None)

    def _of(self, section):
        return [entry for (own, _), entry in self.entries.items() if own == section]

    def _get(self, key):
        return self.entries.get(("study", key))

    def _whole(self, key, preset, least, most=10**9):
        entry = self._get(key)
        if not entry:
            return preset
        if not re.fullmatch(r"\d+", entry.value) or not least <= int(entry.value) <= most:
            raise entry.fault(f"expected a whole number from {least} to {most}, got '{entry.value[:80]}'")
        return int(entry.value)

    def _choice(self, key, preset, words):
        entry = self._get(key)
        if entry and entry.value not in words:
            raise entry.fault(f"expected {', '.join(words[:-1])} or {words[-1]}, got '{entry.value[:80]}'")
        return entry.value if entry else preset

    def _paths(self, key):
        entry = self._get(key)
        if not entry:
            return []
        found = [word.strip().removeprefix("/statistics/") for word in entry.value.split(",")]
        for word in found:
            if not PATH.match(word):
                raise entry.fault(
                    f"expected paths below /statistics such as 'impacts/all/normal_speed/median', got '{word[:80]}'"
                )
            if found.count(word) > 1:
                raise entry.fault(f"'{word}' is there twice")
        return found

    def _tell(self, entry, key, text):
        """What `key = text` is; millsim's complaint with the place of the study deck."""
        try:
            return tell([f"{key}={text}"])[0]
        except UserError as fault:
            raise UserError(_placed(entry, key, fault), fault.status) from None

    def _deck(self):
        """Absolute path of the base deck, its text, and its entries in SI."""
        entry = self._get("deck")
        if not entry:
            raise UserError(f"{self.path}: [study] deck: missing; expected the name of the base deck")
        if not entry.value:
            raise entry.fault("expected the name of the base deck, got nothing")
        path = self.path.parent / entry.value
        try:
            text = lines.read_text(path)
        except UserError as fault:
            raise UserError(f"{entry.where}: [study] deck: {fault}", fault.status) from None
        text, found = self._without(text, lines.entries(text, path))
        try:
            values = tell(f"{one.section}.{one.key}={one.value}" for one in found)
        except UserError:
            for one in found:  # which of them
                self._tell(lines.Entry(one.section, one.key, one.value, one.where), f"{one.section}.{one.key}", one.value)  # fmt: skip
            raise
        return path.resolve(), text, values

    def _without(self, text, found):
        """The base deck without the keys that [set] leaves empty: their defaults hold. Lines keep their numbers."""
        rows, out = text.splitlines(), set()
        for entry in self._of("set"):
            if entry.value:
                continue
            own = [one for one in found if f"{one.section}.{one.key}" == entry.key]
            if not own:
                raise entry.fault("an empty value takes a key out of the base deck, which has none such")
            rows[own[0].line - 1] = ""
            out.add(entry.key)
        return "\n".join(rows) + "\n", [one for one in found if f"{one.section}.{one.key}" not in out]

    def _objectives(self):
        found = [Objective(path, goal) for goal in ("maximise", "minimise") for path in self._paths(goal)]  # fmt: skip
        if not found:
            raise UserError(
                f"{self.path}: [study] maximise: missing, and so is minimise; expected at least one, such as "
                "'maximise = impacts/all/normal_speed/median_above_50mm_s'"
            )
        paths = [objective.path for objective in found]
        for path in paths:
            if paths.count(path) > 1:
                raise self._get("minimise").fault(f"'{path}' is to be maximised already")
        return found

    def _fixed(self):
        """[set], and the keys of [study] that are keys of the deck."""
        found = [self._tell(entry, entry.key, entry.value) for entry in self._of("set") if entry.value]
        for key in ("precision", "max_collisions"):
            entry = self._get(key)
            if entry and ("set", f"run.{key}") in self.entries:
                raise entry.fault(f"stands in [set] as run.{key} already")
            if entry:
                found.append(self._tell(entry, f"run.{key}", entry.value))
        for value in found:
            if value.key == "run.seed":
                raise UserError(f"{self.path}: [set] run.seed: seeds are those of [study] seed and seeds")  # fmt: skip
        return found

    def _vary(self):
        found = []
        for entry in self._of("vary"):
            if ("set", entry.key) in self.entries:
                raise entry.fault(f"stands in [set] already ({self.entries['set', entry.key].where})")
            if entry.key == "run.seed":
                raise entry.fault("seeds are not varied: give [study] replicates")
            try:
                found.append(ranges.parse(entry.key, entry.value))
            except UserError as fault:
                raise UserError(_placed(entry, entry.key, fault), fault.status) from None
        if not found:
            raise UserError(f"{self.path}: [vary]: missing or empty; expected a line such as 'drum.buckles = 2..20'")  # fmt: skip
        return found

    def _limit(self):
        entry = self._get("cpu_limit")
        return self._tell(entry, "run.time", entry.value).value if entry else None

    def study(self) -> Study:
        deck, deck_text, base = self._deck()
        objectives, fixed = self._objectives(), self._fixed()
        vary = self._vary()
        method = self._choice("method", "grid", METHODS)
        samples = self._whole("samples", None, 1)
        if method != "grid" and samples is None:
            raise UserError(f"{self.path}: [study] samples: missing; 'method = {method}' needs their number")  # fmt: skip
        if method == "grid" and samples is not None:
            raise self._get("samples").fault("belongs to the methods lhs, sobol and saltelli; a grid has steps")
        record = [path for path in self._paths("record") if path not in {o.path for o in objectives}]  # fmt: skip
        merged = {value.key: value for value in [*base, *fixed]}
        fixed, start = self._start(merged, fixed, deck)
        return Study(
            file=str(self.path),
            text=self.text,
            deck=str(deck),
            deck_text=deck_text,
            start=start,
            objectives=objectives,
            record=record,
            replicates=self._whole("replicates", 1, 1, 10000),
            seed=self._whole("seed", 1, 0, SEEDS - 1),
            seeds=self._choice("seeds", "shared", ("shared", "own")),
            limit=self._limit(),
            method=method,
            samples=samples,
            base={key: value for key, value in merged.items() if key != "balls.start"},
            fixed=fixed,
            vary=vary,
            places={entry.key: entry for entry in [*self._of("study"), *self._of("vary")]},
        )

    @staticmethod
    def _start(merged, fixed, deck):
        """A start file is named absolutely, for runs have folders of their own; and what it holds counts."""
        value = merged.get("balls.start")
        if not value or value.text == "random":
            return fixed, ""
        path = (deck.parent / value.text).resolve()
        try:
            digest = hashlib.sha256(path.read_bytes()).hexdigest()[:16]
        except OSError as fault:
            raise UserError(f"{path}: start file: {fault.strerror}", status=1) from None
        fixed = [one for one in fixed if one.key != "balls.start"]
        return [*fixed, dataclasses.replace(value, text=str(path))], digest


def _placed(entry, key, fault) -> str:
    """millsim's "[drum] radius: expected ..." where the study deck says so."""
    section, _, name = key.rpartition(".")
    text = str(fault).removeprefix(f"[{section}] {name}: ")
    if entry.section == section and entry.key == name:
        return f"{entry.where}: [{section}] {name}: {text}"
    return f"{entry.where}: [{entry.section}] {entry.key}: {text}"
