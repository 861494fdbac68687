"""The study deck: the varied keys, the base deck and the objectives.

    study = Study("input/figure7.study", ["study.replicates=3"])
    job = study.job(0, {"drum.buckles": 5, "drum.buckle_height": 0.004})        # -> job.run(job)

docs/studies.md lists the keys. Every mistake is a UserError that names file, line and key.
"""

import contextlib
import dataclasses
import fnmatch
import functools
import hashlib
import json
import pathlib
import re

from milltools.base import engine
from milltools.base.errors import UserError
from milltools.read import deck_text as lines
from milltools.read import expression
from milltools.read.values import Value, component_of, order, tell
from milltools.study.plan import cautions, ranges
from milltools.study.plan.formulas import Formulas, holds, is_formula, is_known, text_of

ROW_VERSION = 1  # of the content of a row: another version is another run
SEEDS = 2**32
METHODS = ("grid", "lhs", "sobol", "saltelli")
KEYS = ("deck", "maximise", "minimise", "require", "record", "replicates", "seed", "seeds", "precision",
        "max_collisions", "cpu_limit", "method", "samples")  # fmt: skip
NUMBERS = ("count", "fill", "bulk_fill", "mass")  # of balls: each replaces the others
RIVALS = {"rotor.tip_speed": "rotor.speed"}  # a key replaces another one of the base deck
# output of a run in addition to its statistics, and its cost: these keys have no effect on the statistics
STORED_ONLY = ("output.frames", "output.series", "output.checkpoint", "output.impacts", "run.threads")


@dataclasses.dataclass(frozen=True)
class Objective:
    """An expression of results to be maximised or minimised."""

    path: str  # the expression, such as a path below /statistics
    goal: str  # "maximise" or "minimise"
    unit: str = ""
    description: str = ""

    @property
    def sign(self) -> int:
        """+1: larger is better; -1: smaller."""
        return 1 if self.goal == "maximise" else -1


class Study:
    """A study deck as read, in SI; overrides are "study.KEY=VALUE", "vary.SECTION.KEY=RANGE" or, for [set],
    "SECTION.KEY=VALUE".

    file, text              its name and its text
    deck, deck_text         absolute path and text of the base deck
    objectives, record      list of Objective; further expressions of results
    require                 list of expression.Requirement
    vary                    list of ranges.Range
    formulas                Formulas: the keys that follow from others, and the requirements on keys
    base                    {section.key: Value} of all keys that the base deck and [set] give
    original                the same of the base deck alone
    fixed                   list of the Values that override the base deck
    start, files            digest of its start file, "" for a random start; {section.key: digest} of other files
    method, samples         one of METHODS; how many designs, None for a grid
    replicates, seed, seeds runs of a design; the first seed; "shared" or "own"
    limit                   [s] CPU time of one run, or None
    left_out                designs of the plan (designs.py) that do not meet the requirements on keys
    """

    left_out = 0

    def __init__(self, path, overrides=()):
        self._lines = told = Lines(pathlib.Path(path), overrides)
        self.file, self.text = str(told.path), told.text
        for entry in told.of("life"):
            raise entry.fault("a study with [life] is a chain of runs: only 'mill sweep' makes it")
        deck, self.deck_text, base = told.deck()
        self.deck = str(deck)
        self.objectives, fixed, self.vary = told.objectives(), told.fixed(), told.vary()
        self.method, self.samples = told.method()
        self.require, rules = told.requirements()
        self.record = [path for path in told.paths("record") if path not in {o.path for o in self.objectives}]
        self.original = {value.key: value for value in base}
        merged, fixed = folded(self.original, fixed, told)
        self.base = {key: value for key, value in merged.items() if key != "balls.start"}
        self.fixed, self.files = placed_files(merged, fixed, deck, {one.key for one in self.vary})
        self.start = self.files.pop("balls.start", "")
        self.formulas = self._follow(told.derived(), rules)
        for key in [*self.varied, *self.formulas.derived]:
            self._check_component(key)
        self.replicates, self.seed = told.whole("replicates", 1, 1, 10000), told.whole("seed", 1, 0, SEEDS - 1)
        self.seeds = told.choice("seeds", "shared", ("shared", "own"))
        limit = told.get("cpu_limit")
        self.limit = _tell(limit, "run.time").value if limit else None

    @property
    def paths(self) -> list[str]:
        """All scalars in a row, objectives first."""
        return [*(objective.path for objective in self.objectives), *self.record]

    def _follow(self, derived, rules) -> Formulas:
        """The Formulas of entries with expressions, and of (entry, requirement on keys); the first mistake is a
        UserError. They are tried at the ends of the ranges."""
        vary, texts = [r.about() for r in self.vary], {e.key: expression.parsed(e.value).text for e in derived}
        names = {name for text in texts.values() for name in expression.parsed(text).keys}
        names |= {name for _, rule in rules for name in expression.keys_of(rule)}
        known = {}
        for name in sorted(names):
            vector, place = component_of(name) or (name, None)
            if vector in self.base:
                text = self.base[vector].text
                whole = place is None or self.base[vector].kind != "vector"
                known[name] = [text if whole else text.split()[place], self.base[vector].unit]
        ends = [{r.key: r.values[end] if r.values else (r.low, r.high)[end] for r in self.vary} for end in (0, -1)]
        found = Formulas(vary, [{"key": key, "text": text} for key, text in texts.items()], [], known)
        about = []
        for entry in derived:
            orders = []
            with _placed(entry, entry.key):
                for quantity in (found.look(design)(entry.key) for design in ends):
                    unit = expression.spelled(expression.felt(quantity.powers))
                    orders += [order(entry.key, text_of(quantity.value, kind), unit) for kind in ("number", "whole")]
            one = _first(entry, orders)
            about.append({name: getattr(one, name) for name in ("key", "unit", "kind", "meaning")})
            about[-1]["text"] = texts[entry.key]
        for entry, rule in rules:
            with _placed(entry, entry.key):
                holds(rule, found.look(ends[0]))
        return Formulas(vary, about, [rule for _, rule in rules], known)

    def _check_component(self, key):
        """UserError for a component of a vector that no deck gives."""
        part_of = component_of(key)
        if part_of and part_of[0] not in self.base and part_of[0] not in self.varied:
            raise UserError(f"{self.file}: {key}: neither the base deck nor [set] gives {part_of[0]}: give it first")

    def fault(self, key, text, part="") -> UserError:
        """The UserError for a key of [study] or a varied key, with file and line: the one with this part."""
        if "." in key:
            return self._lines.entries["vary", key].fault(text)
        found = self._lines.lists(key)
        return next((one for one in found if part in " ".join(one.value.split())), found[0]).fault(text)

    def seed_of(self, design: int, replicate: int) -> int:
        """The seed of a run; with shared seeds (common random numbers) it depends on the replicate only."""
        own = design * self.replicates if self.seeds == "own" else 0
        return (self.seed + own + replicate) % SEEDS

    def job(self, design: int, values: dict, replicate: int = 0) -> dict:
        """One run as job.run takes it: JSON-able, with all data needed to run it on another machine."""
        seed = self.seed_of(design, replicate)
        try:
            derived = self.formulas.derive(values)
        except UserError as fault:
            raise UserError(f"{self.file}: {fault}") from None
        chosen = {r.key: (self._text(r, values[r.key]), r.unit) for r in self.vary}
        for key, about in self.formulas.derived.items():
            chosen[key] = (text_of(derived[key], about["kind"]), about["unit"])
        chosen["run.seed"] = (str(seed), "1")
        chosen = self._whole(self._spread(chosen))
        orders = [value.order for value in self.fixed]
        orders += [order(key, text, unit) for key, (text, unit) in chosen.items()]
        return {
            "deck": self.deck,
            "text": self.deck_text,
            "set": orders,
            "values": values | derived,
            "design": design,
            "replicate": replicate,
            "seed": seed,
            "id": self._identity({key: text for key, (text, _) in chosen.items()}),
            "objectives": [objective.path for objective in self.objectives],
            "record": self.record,
            "limit": self.limit,
            "program": self._program,
        }

    def _text(self, r, value) -> str:
        """The shortest text that gives the same number when read; for a file its absolute name."""
        if r.kind == "file" and value not in r.choices:
            return str((pathlib.Path(self.deck).parent / value).resolve())
        return repr(float(value)) if isinstance(value, float) else str(value)

    @property
    def varied(self) -> dict:
        """The range of each varied key; a key such as blade.*.pitch is those of all sections that it names."""
        return self._spread({r.key: r for r in self.vary})

    def _whole(self, chosen: dict) -> dict:
        """{key: (text, unit)} with vectors in place of their components."""
        found = {key: value for key, value in chosen.items() if not component_of(key)}
        for key, (text, unit) in chosen.items():
            if part_of := component_of(key):
                vector, place = part_of
                whole = found[vector][0] if vector in found else self.base[vector].text
                found[vector] = _with(whole, place, text), unit
        return found

    def _spread(self, chosen: dict) -> dict:
        """{key: value} with a key such as blade.*.pitch replaced by those of all sections that it names."""
        return {one: value for key, value in chosen.items() for one in self._named.get(key, [key])}

    @functools.cached_property
    def _named(self):
        """The keys of all sections that a key such as blade.*.pitch names."""
        sections = list(dict.fromkeys(key.rpartition(".")[0] for key in self.base))
        found = {}
        for r in self.vary:
            vector, place = component_of(r.key) or (r.key, None)
            section, _, name = vector.rpartition(".")
            name += "" if place is None else f".{place + 1}"
            if "*" in section:
                found[r.key] = [f"{one}.{name}" for one in sections if fnmatch.fnmatchcase(one, section)]
                if not found[r.key]:
                    named = ", ".join(f"[{one}]" for one in sections)
                    raise self.fault(r.key, f"no section of the base deck is named so; there are {named}")
        return found

    @functools.cached_property
    def _program(self):
        return str(engine.program().resolve())

    @functools.cached_property
    def _varied(self):
        """Placeholders for texts that differ from run to run; the expressions of keys that follow."""
        varied = self._spread(dict.fromkeys([*(r.key for r in self.vary), "run.seed"], "varied"))
        found = varied | {key: one["text"] for key, one in self.formulas.derived.items()}
        whole = self._whole({key: (text, "1") for key, text in found.items()})
        return {key: text for key, (text, _) in whole.items()}

    @functools.cached_property
    def _shared(self):
        """The common settings of all runs, as texts: keys in SI, and others."""
        keys = {k: v.text for k, v in self.base.items() if k not in STORED_ONLY}
        sections = dict.fromkeys(k.rpartition(".")[0] for k in self.base)
        named = [name for name in sections if "." in name]  # the numbers of the balls follow from their order
        files = [sorted(self.files.items())] * bool(self.files)
        return keys, [ROW_VERSION, named, self.start, sorted(self.paths), self.limit, *files]

    def _identity(self, chosen: dict) -> str:
        """16 hex digits of everything that determines a run and its row: all keys in SI (in any notation, from any
        file), the content of files, the values read from the run."""
        keys, rest = self._shared
        whole = [*rest, sorted((keys | chosen).items())]
        return hashlib.sha256(json.dumps(whole).encode()).hexdigest()[:16]

    @property
    def fingerprint(self) -> str:
        """16 hex digits of the common settings of all runs: rows with equal fingerprints belong into one table."""
        return self._identity(self._varied)

    def common(self) -> dict[str, str]:
        """The content of the fingerprint in readable form: {section.key or another name: text}."""
        keys = {k: v.order.partition("=")[2] for k, v in self.base.items() if k not in STORED_ONLY}
        for section, _, name in (one.key.rpartition(".") for one in self.fixed):
            for other in {*NUMBERS} - {name} if name in NUMBERS else ():
                keys.pop(f"{section}.{other}", None)
        rest = {"the start file": self.start and f"one with digest {self.start[:8]}",
                "the files": ", ".join(f"{key} with digest {digest[:8]}" for key, digest in self.files.items()),
                "what is recorded": ", ".join(sorted(self.paths)),
                "study.cpu_limit": "" if self.limit is None else f"{self.limit!r} s"}  # fmt: skip
        return keys | self._varied | {k: v for k, v in rest.items() if v}

    def about(self, planned=None, command="") -> dict:
        """The metadata of the table."""
        own = ("file", "record", "method", "samples", "seed", "replicates", "fingerprint")
        return {name: getattr(self, name) for name in own} | {
            "study": self.text,
            "deck": self.deck_text,
            "common": self.common(),
            "objectives": [dataclasses.asdict(objective) for objective in self.objectives],
            "require": [one.text for one in self.require],
            "notes": cautions.cautions(self),
            "vary": [r.about() for r in self.vary],
            "planned": planned,
            "command": command,
            "version": engine.version(),
            **self.formulas.about(),
        }


class Lines:
    """The lines of one study deck; the first mistake is a UserError."""

    def __init__(self, path, overrides):
        self.path, self.text = path, lines.read_text(path)
        found = lines.entries(self.text, path)
        for entry in found:
            if entry.section not in ("study", "set", "vary", "life"):
                raise UserError(
                    f"{entry.where}: [{entry.section}]: unknown section; there are [study], [set], [vary] and [life]"
                )
        self.entries, self.more = {}, []  # the first line of each key; more lines of lists
        for entry in found:
            self._add(entry)
        for text in overrides:
            self._override(text)
        for (section, key), entry in self.entries.items():
            if section == "study" and key not in KEYS:
                raise entry.fault(f"unknown key; there are {', '.join(KEYS)}")

    def _add(self, entry):
        if (entry.section, entry.key) in self.entries:
            self.more.append(entry)
        else:
            self.entries[entry.section, entry.key] = entry

    def lists(self, key) -> list:
        """All lines of a key of [study] that is a list."""
        return [entry for entry in [self.get(key), *self.more] if entry and entry.key == key]

    def _override(self, text):
        name, equals, value = text.partition("=")
        name = f"study.{name.strip()}" if name.strip() in KEYS else name.strip()
        if not equals or "." not in name:
            raise UserError(f"--set {text}: expected study.KEY=VALUE, vary.SECTION.KEY=RANGE or SECTION.KEY=VALUE")
        section, _, key = name.partition(".")
        if section not in ("study", "vary", "life"):
            section, key = "set", name
        entry, many = lines.Entry(section, key, value.strip(), f"--set {text}"), key in lines.LISTS
        if section == "study" and many and all(not one.line for one in self.lists(key)) and value.strip():
            self._add(entry)  # lines of a list on the command line add up
        else:
            self.entries[section, key] = entry  # in the place of the old one
            self.more = [one for one in self.more if (one.section, one.key) != (section, key)]
        if section == "study" and many and not value.strip():
            del self.entries[section, key]
        # a key that becomes fixed is no longer varied, and the other way round
        if section in ("set", "vary"):
            self.entries.pop(("vary" if section == "set" else "set", key), None)

    def of(self, section):
        return [entry for (own, _), entry in self.entries.items() if own == section]

    def get(self, key):
        return self.entries.get(("study", key))

    def whole(self, key, preset, least, most=10**9, section="study"):
        entry = self.entries.get((section, key))
        if not entry:
            return preset
        if not re.fullmatch(r"\d+", entry.value) or not least <= int(entry.value) <= most:
            raise entry.fault(f"expected a whole number from {least} to {most}, got '{entry.value[:80]}'")
        return int(entry.value)

    def choice(self, key, preset, words):
        entry = self.get(key)
        if entry and entry.value not in words:
            raise entry.fault(f"expected {', '.join(words[:-1])} or {words[-1]}, got '{entry.value[:80]}'")
        return entry.value if entry else preset

    def paths(self, key):
        found = []
        for entry in self.lists(key):
            for word in self._read(entry, lambda word: expression.parsed(word).text):
                if word in found:
                    raise entry.fault(f"'{word}' is given twice")
                found.append(word)
        return found

    def requirements(self):
        """What results must meet; (entry, text) of what keys must meet."""
        results, rules = [], []
        for entry in self.lists("require"):
            for text in expression.split(entry.value):
                if any(map(self._is_key, *self._read(entry, expression.keys_of, [text]))):
                    rules.append((entry, " ".join(text.split())))
                else:
                    results += self._read(entry, expression.Requirement.read, [text])
        return results, rules

    def _is_key(self, name):
        """Whether a name is a key of the deck, or one of a section that it has."""
        sections = {key.rpartition(".")[0] for key in self.given} - {"rotor", "drive"}  # results have these too
        return is_known(name, self.given) or name.rpartition(".")[0] in sections

    def _read(self, entry, read, parts=None):
        """What `read` makes of the parts of a list of expressions."""
        try:
            return [read(part) for part in parts or expression.split(entry.value)]
        except UserError as fault:
            raise entry.fault(str(fault)) from None

    def deck(self):
        """Absolute path of the base deck, its text, and its entries in SI."""
        entry = self.get("deck")
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
        except UserError as whole:
            faults = []
            for one in found:
                try:
                    _tell(one, f"{one.section}.{one.key}")
                except UserError as fault:
                    faults.append(fault)
            raise UserError([str(one) for one in faults], faults[0].status) if faults else whole from None
        self.given_in_deck = found
        self.given = frozenset(
            [*(value.key for value in values), *(key for section, key in self.entries if section != "study")]
        )
        return path.resolve(), text, values

    def derived(self):
        """The entries of keys that follow from others."""
        found = [entry for entry in [*self.of("set"), *self.of("vary")] if self._follows(entry)]
        for entry in found:
            if entry.key == "run.seed":
                raise entry.fault("cannot be set: use seed, seeds or replicates of [study]")
            if "*" in entry.key:
                raise entry.fault("expected one key on the left, got several (*): write a line for each")
            with _placed(entry, entry.key):
                expression.parsed(entry.value)
        return found

    def _follows(self, entry):
        return is_formula(entry.value, self.given)

    def _without(self, text, found):
        """The base deck without the keys that [set] leaves empty; they get their defaults. Lines keep their numbers."""
        rows = text.removesuffix("\n").split("\n")
        out = {entry.key: entry for entry in self.of("set") if not entry.value}
        own = {f"{one.section}.{one.key}": one for one in found}
        replaced = [RIVALS[key] for _, key in self.entries if key in RIVALS]
        out |= {key: None for key in replaced if key in own and ("set", key) not in self.entries}
        for key, entry in out.items():
            if key not in own:
                raise entry.fault("an empty value removes a key from the base deck, but the base deck has no such key")
            rows[own[key].line - 1] = ""
        return "\n".join(rows) + "\n", [one for one in found if f"{one.section}.{one.key}" not in out]

    def objectives(self):
        found = [Objective(path, goal) for goal in ("maximise", "minimise") for path in self.paths(goal)]  # fmt: skip
        if not found:
            raise UserError(
                f"{self.path}: [study] maximise: missing, and so is minimise; expected at least one, such as "
                "'maximise = impacts/all/normal_speed/median_above_floor'"
            )
        paths = [objective.path for objective in found]
        for path in paths:
            if paths.count(path) > 1:
                raise self.get("minimise").fault(f"'{path}' is an objective of 'maximise' already")
        return found

    def fixed(self):
        """[set], and the keys of [study] that are keys of the deck."""
        found = [_tell(entry, entry.key) for entry in self.of("set") if entry.value and not self._follows(entry)]
        for key in ("precision", "max_collisions"):
            entry = self.get(key)
            if entry and ("set", f"run.{key}") in self.entries:
                raise entry.fault(f"is given in [set] as run.{key} already")
            if entry:
                found.append(_tell(entry, f"run.{key}"))
        for value in found:
            if value.key == "run.seed":
                raise UserError(f"{self.path}: [set] run.seed: cannot be set: use seed, seeds or replicates of [study]")
        return found

    def vary(self):
        found = []
        for entry in self.of("vary"):
            if ("set", entry.key) in self.entries:
                raise entry.fault(f"is given in [set] already ({self.entries['set', entry.key].where})")
            if entry.key == "run.seed":
                raise entry.fault("cannot be varied: use seed, seeds or replicates of [study]")
            if not self._follows(entry):
                with _placed(entry, entry.key):
                    found.append(ranges.parse(entry.key, entry.value))
        if not found:
            raise UserError(f"{self.path}: [vary]: missing or empty; expected a line such as 'drum.buckles = 2..20'")
        return found

    def method(self):
        """The method and its number of samples."""
        method, samples = self.choice("method", "grid", METHODS), self.whole("samples", None, 1)
        if method != "grid" and samples is None:
            raise UserError(f"{self.path}: [study] samples: missing; 'method = {method}' needs the number of samples")
        if method == "grid" and samples is not None:
            raise self.get("samples").fault("is only for the methods lhs, sobol and saltelli; for a grid give steps")
        return method, samples


def _with(vector: str, place: int, text: str) -> str:
    """The text of a vector with another component."""
    words = vector.split()
    return " ".join([*words[:place], text, *words[place + 1 :]])


def folded(base, fixed, told):
    """All values by key, and those of `fixed`, with vectors in place of the components in `fixed`."""
    merged, found = dict(base), {}
    for value in fixed:
        if part_of := component_of(value.key):
            vector, place = part_of
            if vector not in merged:
                raise told.entries["set", value.key].fault(f"neither the base deck nor [set] gives {vector}")
            text = _with(merged[vector].text, place, value.text)
            value = dataclasses.replace(merged[vector], text=text)
        merged[value.key] = found[value.key] = value
    return merged, list(found.values())


def placed_files(merged, fixed, deck, varied=()):
    """`fixed` with absolute names of files, because each run has its own folder, and {key: digest} of their content;
    not of keys in `varied`."""
    digests = {}
    for value in [value for key, value in merged.items() if value.is_file and key not in varied]:
        path = (deck.parent / value.text).resolve()
        try:
            digests[value.key] = hashlib.sha256(path.read_bytes()).hexdigest()[:16]
        except OSError as fault:
            what = "start file" if value.key == "balls.start" else value.key
            raise UserError(f"{path}: {what}: {fault.strerror}", status=1) from None
        fixed = [one for one in fixed if one.key != value.key]
        fixed.append(dataclasses.replace(value, text=str(path)))
    return fixed, digests


@contextlib.contextmanager
def _placed(entry, key):
    """Adds the place in the study deck to millsim's messages about a key ("[drum] radius: expected ...")."""
    try:
        yield
    except UserError as fault:
        section, _, name = key.rpartition(".")
        raise UserError(entry.fault(str(fault).removeprefix(f"[{section}] {name}: ")), fault.status) from None


def _first(entry, orders) -> Value:
    """The first of these that millsim accepts; else its message about the first."""
    for one in orders:
        with contextlib.suppress(UserError):
            return tell([one])[0]
    with _placed(entry, entry.key):
        return tell(orders[:1])[0]


def _tell(entry, key) -> Value:
    """The value of an entry for a key of the deck."""
    with _placed(entry, key):
        return tell([f"{key}={entry.value}"])[0]
