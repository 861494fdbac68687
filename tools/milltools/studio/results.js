/* What is known about a design: collects the messages of a source, and answers with numbers and standard errors (null:
   not yet known). Draws nothing. SI units. */
'use strict';

const MillResults = (() => {
  const NORMAL = 1.96; // errors of the engine are scaled so that +- this multiple of them is the 95 % interval
  const THRESHOLDS = [1e-4, 1e-3, 1e-2]; // [J] from which an impact is hard
  const BATCHES = 16; // for errors of rates that the engine gives none of
  const KEPT = 600; // points of the curves over time

  const sum = (values) => Array.from(values).reduce((a, b) => a + b, 0);
  const known = (value) => typeof value === 'number' && Number.isFinite(value);
  /** Work [J] of all motions, and of each one. */
  const works = (state) => ({ all: state.work.length === undefined ? state.work : sum(state.work), each: state.motionWork ?? state.work });
  const found = (value, error) => ({ value: known(value) ? value : null, error: known(error) ? error : null });

  /** Every second point once there are too many: the curve stays, its memory does not grow. */
  function thin(points) {
    if (points.length > KEPT) points.splice(0, points.length, ...points.filter((_, k) => k % 2 === 0 || k === points.length - 1));
  }

  /** The values at the ends of `count` equal parts from begin to end, between points [[time, value], ...]. */
  function at(points, begin, end, count) {
    let k = 0;
    return Array.from({ length: count + 1 }, (_, j) => {
      const time = begin + ((end - begin) * j) / count;
      while (k + 2 < points.length && points[k + 1][0] < time) k += 1;
      const [a, b] = [points[k], points[k + 1]];
      return a[1] + ((time - a[0]) / (b[0] - a[0] || 1)) * (b[1] - a[1]);
    });
  }

  /** Number of impacts at or above an energy in a spectrum; within a bin as if spread evenly over its logarithm. */
  function above({ edges, count }, energy, kind = 'all') {
    let total = 0;
    const bins = count[kind] ?? [];
    for (let k = 0; k < bins.length; k++) {
      const [low, high] = [edges[k], edges[k + 1]];
      if (low >= energy) total += bins[k];
      else if (high > energy && low > 0) total += (bins[k] * Math.log(high / energy)) / Math.log(high / low);
    }
    return total;
  }

  /** The energy [J] above which impacts take half of what all take. */
  function halfAbove({ edges, dissipation }) {
    const all = dissipation.all ?? [], half = sum(all) / 2;
    let seen = 0;
    for (let k = all.length - 1; k >= 0; k--) {
      seen += all[k];
      if (!(half > 0 && seen >= half)) continue;
      const share = (seen - half) / all[k]; // of the bin's loss below it, as the engine has it
      return edges[k] > 0 && edges[k + 1] < Infinity ? edges[k] * (edges[k + 1] / edges[k]) ** share : edges[k];
    }
    return null;
  }

  class Record {
    means = []; work = []; tails = []; // over time
    state = null; first = null; statistics = null; spectrum = null;

    /** `mill`: the message of a new mill. */
    constructor(mill) {
      this.mill = mill;
    }

    /** A point of the work over time at every state; the drawing makes power of it. */
    see(state) {
      this.state = state;
      const { all: work, each } = works(state);
      this.first ??= { time: state.time, work: Array.from(each), dissipation: Array.from(state.dissipation), energy: { ...state.energy } };
      const last = this.work[this.work.length - 1];
      if (last && state.time <= last.time) return;
      this.work.push({ time: state.time, work });
      thin(this.work);
    }

    learn({ statistics, spectrum }) {
      this.statistics = statistics;
      this.spectrum = spectrum ?? this.spectrum;
      const time = this.state?.time;
      const { value, error } = this.power();
      const last = this.means[this.means.length - 1];
      if (value === null || time === undefined || (last && time <= last.time)) return;
      this.means.push({ time, value, error });
      thin(this.means);
      if (!this.spectrum) return;
      this.tails.push({ time: statistics.duration, counts: THRESHOLDS.map((energy) => above(this.spectrum, energy)) });
      thin(this.tails);
    }

    /** Whether statistics have begun. */
    get begun() { return this.statistics?.duration > 0; }

    /** Power of the drive [W]. */
    power() {
      if (!this.begun) return found(null);
      const { drive, precision } = this.statistics;
      return found(drive?.power, precision?.drive_power?.standard_error ?? drive?.power_error);
    }

    /** The mean power [W] in equal windows of time, for the curve: [[time, power], ...]. */
    powers(windows = 60) {
      const { work } = this, end = work.at(-1)?.time, begin = work[0]?.time, count = Math.min(windows, Math.floor(work.length / 2));
      if (!(end > begin) || count < 2) return [];
      const wide = (end - begin) / count, done = at(work.map((one) => [one.time, one.work]), begin, end, count);
      return done.slice(1).map((one, k) => [begin + (k + 0.5) * wide, (one - done[k]) / wide]);
    }

    /** [J] from which impacts are hard: THRESHOLDS[which]; beyond them what the deck or the engine says. */
    threshold(which) { return THRESHOLDS[which] ?? this.statistics?.hard_energy ?? NaN; }

    /** Impacts at or above this threshold per second, and per joule of the drive's work. */
    hard(which) {
      const nothing = { rate: found(null), perJoule: found(null) };
      if (!this.begun || !this.spectrum) return nothing;
      const { precision, duration } = this.statistics, power = this.power();
      const [own, per] = [precision?.hard_rate, precision?.hard_per_joule];
      if (!(which in THRESHOLDS)) return known(own?.value) ? { rate: found(own.value, own.standard_error), perJoule: found(per?.value ?? null, per?.standard_error) } : nothing;
      const rate = found(above(this.spectrum, THRESHOLDS[which]) / duration, this.#scatter(which));
      if (!(power.value > 0)) return { rate, perJoule: found(null) };
      const both = rate.error !== null && power.error !== null && rate.value > 0;
      const relative = both ? Math.hypot(rate.error / rate.value, power.error / power.value) : NaN;
      return { rate, perJoule: found(rate.value / power.value, (rate.value / power.value) * relative) };
    }

    /** Standard error [1/s] of a rate of hard impacts, from the scatter of BATCHES equal parts of the sampled time; NaN
        while a part has fewer than two readings on average. */
    #scatter(which) {
      const { tails } = this, begin = tails[0]?.time, end = tails[tails.length - 1]?.time;
      if (tails.length < 2 * BATCHES || !(end > begin)) return NaN;
      const done = at(tails.map((one) => [one.time, one.counts[which]]), begin, end, BATCHES);
      const rates = done.slice(1).map((count, k) => ((count - done[k]) * BATCHES) / (end - begin));
      const mean = sum(rates) / BATCHES;
      const wider = 2.131 / NORMAL; // Student's t of 15 degrees of freedom
      return wider * Math.sqrt(sum(rates.map((rate) => (rate - mean) ** 2)) / (BATCHES - 1) / BATCHES);
    }

    /** An entry of the engine's table of precision, such as "median_above_floor". */
    precise(name) {
      const one = name.split('.').reduce((part, word) => part?.[word], this.statistics?.precision);
      return this.begun ? found(one?.value, one?.standard_error) : found(null);
    }

    /** Where the power goes: {ins, outs: [{name, kind, value [W]}], since [s]}: in the sampled time; before there is one,
        since the start. Motions that take power from the balls are among the outs, and so is what the balls keep. */
    flows() {
      const { state, first, statistics, mill } = this;
      let rows, time;
      if (this.begun && statistics.motions) {
        time = statistics.duration;
        rows = mill.motions.map((name) => ({ name, value: statistics.motions[name]?.power ?? 0 }));
        rows.push(...mill.kinds.map((kind) => ({ name: kind, kind, value: -(statistics.impacts[kind]?.dissipated_power ?? 0) })));
      } else if (state && state.time > first.time) {
        time = state.time - first.time;
        rows = mill.motions.map((name, k) => ({ name, value: (works(state).each[k] - first.work[k]) / time }));
        rows.push(...mill.kinds.map((kind, k) => ({ name: kind, kind, value: -(state.dissipation[k] - first.dissipation[k]) / time })));
      } else return null;
      rows.push({ name: 'the balls', kept: true, value: -sum(rows.map((row) => row.value)) });
      const most = Math.max(...rows.map((row) => Math.abs(row.value)));
      rows = rows.filter((row) => Math.abs(row.value) > 1e-3 * most);
      const side = (sign) => rows.filter((row) => sign * row.value > 0).map((row) => ({ ...row, value: Math.abs(row.value) }))
        .sort((a, b) => b.value - a.value);
      return { ins: side(1), outs: side(-1), time };
    }

    /** The energy balance since the first state [J]: work of each motion, losses of each kind, changes of the energies,
        what is left over, and that divided by the energy turned over. */
    balance() {
      const { state, first, mill } = this;
      if (!state || state.time <= first.time) return null;
      const work = mill.motions.map((name, k) => [name, works(state).each[k] - first.work[k]]);
      const loss = mill.kinds.map((name, k) => [name, state.dissipation[k] - first.dissipation[k]]).filter(([, value]) => value);
      const stored = ['kinetic', 'rotational', 'potential'].map((name) => [name, state.energy[name] - first.energy[name]]);
      const total = (rows) => sum(rows.map(([, value]) => value));
      const whole = first.time === 0 && state.balance; // the engine's own account has every digit
      const over = whole ? state.balance.error : total(work) - total(loss) - total(stored);
      const turned = whole ? state.balance.turnover : sum([...work, ...loss, ...stored].map(([, value]) => Math.abs(value)));
      return { since: first.time, work, loss, stored, totals: { work: total(work), loss: total(loss), stored: total(stored) }, over, relative: turned > 0 ? Math.abs(over) / turned : 0 };
    }

    /** What stays of it when it is frozen: its curves no longer grow. */
    frozen() {
      const copy = new Record(this.mill);
      return Object.assign(copy, { ...this, means: [...this.means], work: [...this.work], tails: [...this.tails] });
    }
  }

  /** A verdict on two numbers with standard errors: "better", "worse", "cannot be told apart", or "not yet known".
      `good`: 1 if more is better, -1 if less is; 0: "more" or "less". */
  function verdict(here, there, good) {
    const apart = here.value - there.value;
    if (here.error === null || there.error === null) return { apart, error: null, words: 'not yet known' };
    const error = Math.hypot(here.error, there.error);
    if (Math.abs(apart) <= NORMAL * error) return { apart, error, words: 'cannot be told apart' };
    const more = apart > 0;
    return { apart, error, words: good === 0 ? (more ? 'more' : 'less') : more === good > 0 ? 'better' : 'worse' };
  }

  /** Rows of the comparison of two records: {name, unit, here, there, apart, error, words}. */
  function compare(here, there, which) {
    const energy = which in THRESHOLDS ? `of ${MillWords.quantity(THRESHOLDS[which], 'J')} or more` : 'that lose half of the energy';
    const [a, b] = [here.hard(which), there.hard(which)];
    return [
      ['Power of the drive', 'W', here.power(), there.power(), 0],
      [`Impacts ${energy}`, '/s', a.rate, b.rate, 1],
      [`Impacts ${energy}, per work`, '/J', a.perJoule, b.perJoule, 1],
      ['Median impact speed above the floor', 'm/s', here.precise('median_above_floor'), there.precise('median_above_floor'), 1],
      ['Contacts', '/s', here.precise('rate.all'), there.precise('rate.all'), 0],
    ].map(([name, unit, one, other, good]) => ({ name, unit, here: one, there: other, ...verdict(one, other, good) }));
  }

  /** Keys whose values differ in two mills: [[name, here, there], ...], as their decks say it; "none": no such key. */
  function differences(here, there) {
    const [a, b] = [here, there].map(({ keys }) => new Map(keys.map((key) => [`${key.section}.${key.key}`, key.value])));
    const [own, other] = [here, there].map(({ text }) => MillDeck.values(text));
    return [...new Set([...a.keys(), ...b.keys()])].filter((name) => a.get(name) !== b.get(name))
      .map((name) => [name, own.get(name) ?? a.get(name) ?? 'none', other.get(name) ?? b.get(name) ?? 'none']);
  }

  return { Record, THRESHOLDS, NORMAL, above, halfAbove, verdict, compare, differences };
})();
