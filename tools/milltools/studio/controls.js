/* Which keys of a deck get a slider, by their names, and from where to where it goes. Bounds, units and meanings are
   those that the engine tells of its keys; here are only rules of names and of ranges around the present value. */
'use strict';

const MillControls = (() => {
  const D = MillDeck;
  const AROUND = [0.1, 2]; // range of a value, as parts of it
  /** @type {[RegExp, string, string, number[] | 'bounds'][]} */
  // [section, key, label ($1: name of the section), range: parts of the value, or "bounds" (at most `top`)]
  const RULES = [
    [/^rotor$/, 'speed', 'Speed of the rotor', AROUND],
    [/^motion\.(.+)$/, 'speed', 'Speed of $1', AROUND],
    [/^motion\.(.+)$/, 'frequency', 'Frequency of $1', [0.25, 2]],
    [/^motion\.(.+)$/, 'amplitude', 'Amplitude of $1', AROUND],
    [/^balls$/, 'count', 'Balls', [0, 2]],
    [/^balls\.(.+)$/, 'count', 'Balls, $1', [0, 2]],
    [/^balls$/, 'diameter', 'Ball diameter', [0.5, 2]],
    [/^balls\.(.+)$/, 'diameter', 'Ball diameter, $1', [0.5, 2]],
    [/^contact$/, 'restitution', 'Restitution', 'bounds'],
    [/^contact$/, 'friction', 'Friction', 'bounds'],
    [/^drum$/, 'buckles', 'Buckles', [0, 2.5]],
    [/^drum$/, 'buckle_height', 'Buckle height', [0, 3]],
    [/^drum$/, 'lifters', 'Lifters', [0, 2.5]],
    [/^drum$/, 'lifter_height', 'Lifter height', AROUND],
    [/^drum$/, 'lifter_width', 'Lifter width', AROUND],
    [/^drum$/, 'lifter_front', 'Lifter front', [0, 2]],
    [/^drum$/, 'lifter_back', 'Lifter back', [0, 2]],
    [/^drum$/, 'repeats', 'Repeats of the wall', [0, 2.5]],
    [/^drum$/, 'wave_1', 'Height of waves', [-2, 2]],
    [/^drum$/, 'lean_2', 'Lean of waves', [-2, 2]],
  ];
  // keys that give the same value in another way: a deck has one of them
  const INSTEAD = { count: ['fill', 'bulk_fill', 'mass'], speed: ['tip_speed'], radius: ['diameter'], shaft_radius: ['shaft_diameter'] };
  const AMOUNT = { fill: 'Filling', bulk_fill: 'Filling with voids', mass: 'Mass of balls' };

  /** A step of 1, 2 or 5 times a power of ten, about a 150th of a range; 1 for whole numbers. */
  function stepOf(range, whole) {
    const rough = range / 150, power = 10 ** Math.floor(Math.log10(rough || 1));
    const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= rough * 0.999);
    return whole ? Math.max(1, Math.round(step)) : step;
  }

  /** The number [SI] of a key; of a vector its component of the largest size. */
  function numberOf(value) {
    const { numbers } = D.measured(value);
    return numbers.length ? numbers.reduce((a, b) => (Math.abs(b) > Math.abs(a) ? b : a)) : NaN;
  }

  /** What a key has in the deck's text, else what the engine says. */
  const shown = (text, key) => D.get(text, key.section, key.key) ?? key.value;

  function control(key, label, range, text, others) {
    const given = D.get(text, key.section, key.key), own = given === undefined ? null : D.measured(given), whole = key.type === 'whole';
    const share = own?.unit.endsWith('critical') && own.numbers[0]; // of a speed that only the engine knows
    const unit = share ? { name: own.unit, size: numberOf(key.value) / share } : D.unit(key.unit, given);
    const exact = own?.numbers.length && own.unit === unit.name; // the deck's own digits
    const value = exact ? numberOf(given) : numberOf(key.value || '') / unit.size;
    if (!Number.isFinite(value)) return null;
    const limit = (one) => (one === null || one === undefined ? null : one / unit.size);
    const [lo, hi] = [limit(key.lo), limit(key.hi)];
    let [from, to] = range === 'bounds' ? [lo ?? 0, Math.min(hi ?? Infinity, Math.max(1, value))] : range.map((part) => part * value);
    if (!value && range !== 'bounds') [from, to] = [0, whole ? 10 : 1];
    if (from > to) [from, to] = [to, from];
    if (whole) to = Math.max(to, 10);
    const step = stepOf(to - from, whole);
    [from, to] = [Math.floor(from / step + 1e-6) * step, Math.ceil(to / step - 1e-6) * step];
    if (lo !== null) from = Math.max(from, key.above && from <= lo ? Math.min(step, to) : lo);
    if (hi !== null) to = Math.min(to, hi);
    const tidy = (one) => Number(one.toPrecision(12));
    const set = (deck, to) => {
      if (key.type !== 'vector') return D.set(deck, key.section, key.key, `${D.digits(to)} ${unit.name}`.trim(), INSTEAD[key.instead || key.key]?.concat(key.instead || key.key));
      const before = D.measured(shown(deck, key)), numbers = before.numbers.map((one) => D.digits(value ? (one * to) / numberOf(shown(deck, key)) : to));
      return D.set(deck, key.section, key.key, `${numbers.join(' ')} ${before.unit}`);
    };
    return { id: `${key.section}.${key.key}`, key, label, unit: unit.name, value: tidy(value), lo, hi, above: Boolean(key.above), whole, from: tidy(from), to: tidy(to),
      step: tidy(step), meaning: key.meaning, set: (deck, to) => others.reduce((made, other) => other(made, to), set(deck, to)) };
  }

  /** The ratio of a key of a motion to the same key of the motion that carries it: kept when that one changes. */
  function ratio(key, of, base, text) {
    const [value, other] = [numberOf(key.value), numberOf(base.value)];
    if (!value || !other) return null;
    const name = (one) => one.section.replace(/^motion\./, ''), present = value / other;
    const [from, to] = [0, 2 * present].sort((a, b) => a - b), step = stepOf(to - from, false);
    const unit = D.unit(key.unit, D.get(text, key.section, key.key));
    const set = (deck, to) => D.set(deck, key.section, key.key, `${D.digits((to * numberOf(shown(deck, base)) * D.unit(base.unit, shown(deck, base)).size) / unit.size)} ${unit.name}`);
    return { id: `${key.section}.${key.key}/${of}`, key, label: `${key.key === 'speed' ? 'Speed ratio' : 'Frequency ratio'} ${name(key)} : ${name(base)}`, unit: '', value: Number(present.toPrecision(6)),
      lo: null, hi: null, above: false, whole: false, from, to, step, meaning: `${key.meaning}; divided by that of ${name(base)}, which carries it`, set };
  }

  /** The controls of a deck's text and the engine's keys, in the order of RULES: {id, label, unit, value and bounds lo, hi in
      this unit (null: none), range from, to with step, meaning, set(deck, value) -> deck}. */
  function choose(text, keys) {
    const known = new Map(keys.map((key) => [`${key.section}.${key.key}`, key])), found = [];
    const carrier = (key) => known.get(`motion.${known.get(`${key.section}.on`)?.value}.${key.key}`);
    const paired = (key) => key.section.startsWith('motion.') && key.key !== 'amplitude' && carrier(key)?.type === 'number';
    const there = [...D.values(text).keys()]; // a class of sizes has a section of its own only in the engine
    const ours = keys.filter((one) => !one.section.startsWith('balls.') || there.some((name) => name.startsWith(`${one.section}.`)));
    for (const [section, name, label, range] of RULES) {
      for (const key of ours.filter((one) => one.key === name && section.test(one.section))) {
        const words = key.section.replace(section, label);
        if (paired(key)) {
          found.push(ratio(key, carrier(key).section, carrier(key), text));
          continue;
        }
        const given = [key, ...keys.filter((one) => one.section === key.section && one.instead === name)].find((one) => D.get(text, one.section, one.key) !== undefined) ?? key;
        const riders = keys.filter((one) => one.key === name && paired(one) && carrier(one) === key);
        const others = riders.map((one) => (deck) => ratio(one, key.section, key, text)?.set(deck, numberOf(one.value) / numberOf(key.value)) ?? deck);
        found.push(control(given, given === key ? words : words.replace(/^Balls/, AMOUNT[given.key]), given === key ? range : AROUND, text, others));
      }
    }
    return found.filter(Boolean);
  }

  return { choose, shown, INSTEAD };
})();
