/* A source for the tests of the studio's page: balls on circles in a drum, with made-up results, as source.js tells of
   them. It refuses a restitution above 1, in the engine's words. window.fake.loads: the decks it was given. */
'use strict';

class FakeSource {
  constructor(colours, live = true) {
    Object.assign(this, { colours, live, on: () => {}, time: 0, loads: [], runs: [] });
    window.fake = this;
    if (!live) setTimeout(() => { this.load('[balls]\ncount = 8\n'); this.on({ type: 'progress', done: 0.4, left: 300, note: '' }); }, 0);
  }

  /** Bounds that only the source knows: the page must take them from here. */
  keys(deck) {
    const values = MillDeck.values(deck), has = (name) => values.has(name);
    const si = (name) => { const { numbers, unit } = MillDeck.measured(values.get(name)); return `${numbers.map((x) => x * ({ mm: 1e-3, rpm: Math.PI / 30, deg: Math.PI / 180 }[unit] ?? 1)).join(' ')} ${{ mm: 'm', rpm: 'rad/s', deg: 'rad' }[unit] ?? unit}`.trim(); };
    const known = { speed: ['number', 'rad/s', -1e9, 1e9], count: ['whole', '', 1, 123456], diameter: ['number', 'm', 0.001, 0.0077], restitution: ['number', '', 0, 1],
      friction: ['number', '', 0, 10], buckles: ['whole', '', 2, 500], buckle_height: ['number', 'm', 0, 1e9], radius: ['number', 'm', 0, 1e4], on: ['name', '', null, null],
      kind: ['choice', '', null, null], sample_from: ['number', 's', 0, 1e9], amplitude: ['number', 'rad', -1e9, 1e9], frequency: ['number', 'Hz', 0, 1e9] };
    const found = [...values.keys()].map((name) => [name.slice(0, name.lastIndexOf('.')), name.slice(name.lastIndexOf('.') + 1)]).filter(([, key]) => key in known).map(([section, key]) => {
      const [type, unit, lo, hi] = known[key], name = `${section}.${key}`;
      return { section, key, value: unit ? si(name) : values.get(name), type, unit, lo, hi, above: 0, words: key === 'kind' ? 'turn|swing|shift|table' : '', meaning: `the meaning of ${key}`, instead: '' };
    });
    if (has('balls.count')) found.push({ section: 'gravity', key: 'acceleration', value: '0 0 -9.81 m/s^2', type: 'vector', unit: 'm/s^2', lo: null, hi: null, above: 0, words: '', meaning: 'acceleration of gravity', instead: '' });
    return found;
  }

  load(deck, files = new Map(), set = []) {
    this.loads.push({ deck, files, set });
    const restitution = Number(MillDeck.get(deck, 'contact', 'restitution') ?? 0.8);
    if (!(restitution <= 1)) {
      setTimeout(() => this.on({ type: 'failed', lines: [`deck:7: [contact] restitution: expected a number from 0 to 1, got '${restitution}'`] }), 20);
      return;
    }
    clearInterval(this.timer);
    Object.assign(this, { deck, time: 0, results: 0, balls: Math.min(60, Number(MillDeck.get(deck, 'balls', 'count') ?? 20)), speed: MillDeck.measured(MillDeck.get(deck, 'rotor', 'speed') ?? '100').numbers[0] });
    const around = 24, points = [], corners = [];
    for (let k = 0; k < around; k++) {
      for (const x of [-0.05, 0.05]) points.push(x, 0.07 * Math.cos((2 * Math.PI * k) / around), 0.07 * Math.sin((2 * Math.PI * k) / around));
      const [a, b] = [2 * k, 2 * ((k + 1) % around)];
      corners.push(a, b, a + 1, b, b + 1, a + 1);
    }
    const box = [-1, 1].flatMap((x) => [-1, 1].flatMap((y) => [-1, 1].flatMap((z) => [0.05 * x, 0.07 * y, 0.07 * z])));
    const head = { drawn: this.balls, runs: [[this.balls, 0.012, 0.007]], motions: ['rotor', 'jar'], carrier: -1, poses: this.poses(), colours: this.colours, slice: 0, gravity: [0, 0, -9.81],
      bodies: [{ points: Float32Array.from(points), corners: Uint32Array.from(corners), look: 'shell', motion: -1 },
        { points: Float32Array.of(0, -0.01, 0, 0, 0.01, 0, 0, 0, 0.05, 0.02, 0, 0), corners: Uint32Array.of(0, 1, 2, 0, 2, 3, 1, 3, 2, 0, 3, 1), look: 'steel', motion: 0 }],
      edges: { lines: Float32Array.of(-0.05, 0, 0.07, 0.05, 0, 0.07), width: 0.0003 }, hulls: [Float32Array.from(box), Float32Array.from(box)],
      up: [0, 0, 1], views: { front: [0.8, -0.5, 0.3], 'three-quarter': [0.5, -0.7, 0.45], end: [1, 0, 0] } };
    setTimeout(() => {
      this.on({ type: 'mill', head, keys: this.keys(deck), deck, warnings: [], kinds: ['ball_ball', 'ball_drum'], motions: ['rotor', 'jar'], species: [{ name: 'balls', diameter: 0.012, mass: 0.007 }], period: 0.06, end: 1 });
      this.tell();
    }, 20);
  }

  poses() {
    const c = Math.cos(10 * this.time), s = Math.sin(10 * this.time), still = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0];
    return Float32Array.of(1, 0, 0, 0, 0, c, -s, 0, 0, s, c, 0, ...still);
  }

  tell(factor = 0) {
    const positions = new Float32Array(3 * this.balls), speeds = new Float32Array(this.balls), t = this.time, work = this.speed * t;
    for (let k = 0; k < this.balls; k++) {
      const radius = 0.02 + 0.04 * (k / this.balls), angle = 10 * t + k;
      positions.set([-0.04 + 0.08 * ((k * 0.37) % 1), radius * Math.cos(angle), radius * Math.sin(angle)], 3 * k);
      speeds[k] = 20 * radius;
    }
    this.on({ type: 'state', time: t, contacts: Math.round(1e5 * t), positions, speeds, poses: this.poses(), energy: { kinetic: 0.1, rotational: 0, potential: 0, start: 0.1 }, work, motionWork: Float64Array.of(work, 0),
      dissipation: Float64Array.of(0.7 * work, 0.3 * work), collisions: Float64Array.of(7e4 * t, 3e4 * t), balance: { error: 1e-15 * work, turnover: 2 * work }, factor, rate: 1e5 * factor, ended: false });
  }

  /** Power [W] equals the rotor's speed in rpm; its error is known after 0.5 s and falls as one over the root of time. */
  learn() {
    const t = this.time, power = this.speed, error = t > 0.5 ? (0.02 * power) / Math.sqrt(t) : null, value = (x, relative = 0.02) => ({ value: x, standard_error: error && relative * x, degrees_of_freedom: 20 });
    const edges = Float64Array.from({ length: 61 }, (_, k) => 10 ** (-8 + k / 10)), bins = (scale) => Float64Array.from({ length: 60 }, (_, k) => Math.round(scale * t * Math.exp(-(((k - 35) / 12) ** 2))));
    const lost = (scale) => Float64Array.from(bins(scale), (n, k) => n * edges[k]), impact = (share) => ({ count: 1e5 * share * t, rate: 1e5 * share, dissipated_power: share * power, normal_speed: { median: 0.3 } });
    this.on({ type: 'results', sample_from: 0, settled: 1, statistics: { duration: t, hard_energy: 1e-3, impacts: { ball_ball: impact(0.7), ball_drum: impact(0.3), all: impact(1) }, motions: { rotor: { power }, jar: { power: 0 } }, drive: { power, power_error: error },
      precision: { drive_power: value(power, error / power), rate: { all: value(1e5) }, hard_rate: value(50 * power), hard_per_joule: value(50), median_above_floor: value(0.3, 0.1) } },
      spectrum: { edges, count: { ball_ball: bins(7000), ball_drum: bins(3000), all: bins(10000) }, dissipation: { ball_ball: lost(7000), ball_drum: lost(3000), all: lost(10000) } } });
  }

  /** Ten steps of simulated time a second, long ones unless it is slow motion. */
  run({ factor }) {
    this.runs.push(factor);
    clearInterval(this.timer);
    this.timer = setInterval(() => {
      this.time += Math.min(factor, 1) * 0.1;
      this.tell(Math.min(factor, 1));
      this.learn();
    }, 50);
  }

  pause() {
    clearInterval(this.timer);
  }

  advance(by) {
    this.time += by;
    this.tell();
    this.learn();
  }
}
