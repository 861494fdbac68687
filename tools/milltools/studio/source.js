/* Where the page's mill comes from: EngineSource, a worker with the engine. What it posts is what WatchSource (watch/)
   posts too:
     {type: 'mill', head, keys, deck, warnings, kinds, motions, species, volume, period, end}   a new mill
     {type: 'state', time, contacts, positions, speeds, poses, energy, work, motionWork, dissipation, collisions, balance,
      factor, rate, ended}                                                      often
     {type: 'results', sample_from, settled, statistics, spectrum}              now and then
     {type: 'failed', lines}                                                    messages of millsim
   `head` is that of Mill3D.View. All numbers in SI units. */
'use strict';

/** What Mill3D.View needs to know of a mill: from what the engine tells of it, its outlines and its first state. */
const millHead = (() => {
  const SHARP = Math.cos((35 * Math.PI) / 180); // of the angle between the normals of triangles at an edge

  const minus = (a, b) => a.map((x, k) => x - b[k]);
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const dot = (a, b) => a.reduce((sum, x, k) => sum + x * b[k], 0);
  const unit = (a) => { const size = Math.hypot(...a); return size ? a.map((x) => x / size) : a; };

  /** A part of an outline, with each point once. */
  function part({ points, corners, kind }, chosen) {
    const known = new Map(), own = [], triangles = [];
    for (let k = 0; k < corners.length; k++) {
      if (!chosen(kind[Math.floor(k / 3)])) continue;
      const point = points.subarray(3 * corners[k], 3 * corners[k] + 3), name = point.join();
      if (!known.has(name)) {
        known.set(name, own.length / 3);
        own.push(...point);
      }
      triangles.push(known.get(name));
    }
    return { points: Float32Array.from(own), corners: Uint32Array.from(triangles) };
  }

  /** Ends of the sharp edges of a part. */
  function sharp({ points, corners }) {
    const edges = new Map(), at = (k) => Array.from(points.subarray(3 * k, 3 * k + 3));
    for (let k = 0; k < corners.length; k += 3) {
      const three = Array.from(corners.subarray(k, k + 3)), [a, b, c] = three.map(at);
      const normal = unit(cross(minus(b, a), minus(c, a)));
      three.forEach((from, j) => {
        const to = three[(j + 1) % 3], name = from < to ? `${from} ${to}` : `${to} ${from}`;
        edges.set(name, [...(edges.get(name) ?? []), normal]);
      });
    }
    const lines = [...edges].filter(([, normals]) => normals.length < 2 || dot(normals[0], normals[1]) < SHARP);
    return lines.flatMap(([name]) => name.split(' ').flatMap((k) => at(Number(k))));
  }

  /** Points with a pose, three rows of four. */
  function moved(points, pose) {
    return Float32Array.from(points, (_, i) => {
      const row = 4 * (i % 3), from = i - (i % 3);
      return pose[row] * points[from] + pose[row + 1] * points[from + 1] + pose[row + 2] * points[from + 2] + pose[row + 3];
    });
  }

  /** Upward direction, and directions of the named views, as in player.py. */
  function views({ gravity, axis }) {
    const up = dot(gravity, gravity) ? unit(gravity.map((x) => -x)) : [0, 0, 1];
    const along = [0, 1, 2].map((k) => (Math.abs(up[0]) < 0.99 ? Number(k === 0) : Number(k === 1)));
    const ahead = unit(minus(along, up.map((x) => x * dot(up, along)))), aside = cross(up, ahead);
    const view = (azimuth, elevation) => {
      const [a, e] = [azimuth, elevation].map((x) => (x * Math.PI) / 180);
      return up.map((x, k) => Math.cos(e) * (Math.cos(a) * ahead[k] + Math.sin(a) * aside[k]) + Math.sin(e) * x);
    };
    return { up, views: { front: view(-32, 17), 'three-quarter': view(-58, 27), end: axis } };
  }

  /** [[number, diameter, mass], ...] of consecutive balls of one species. */
  function runs({ species, species_of: of }) {
    const found = [];
    of.forEach((kind, k) => {
      if (k && of[k - 1] === kind) found.at(-1)[0] += 1;
      else found.push([1, species[kind].diameter, species[kind].mass]);
    });
    return found;
  }

  return (mill, outlines, { poses }, colours) => {
    const wall = new Set(mill.container), bodies = [], { carrier, box } = mill;
    outlines.forEach((outline, k) => {
      for (const look of ['shell', 'steel']) {
        const own = part(outline, (kind) => wall.has(kind) === (look === 'shell'));
        if (own.corners.length) bodies.push({ ...own, look, motion: k - 1 });
      }
    });
    const shells = bodies.filter(({ look }) => look === 'shell');
    const place = (k) => poses.subarray(12 * k, 12 * k + 12);
    const vessel = Float32Array.from(shells.flatMap(({ points, motion }) => [...(motion < 0 ? points : moved(points, place(motion)))]));
    const swept = Float32Array.from({ length: 24 }, (_, i) => box[(i % 3) + (Math.floor(i / 3) & (1 << (i % 3)) ? 3 : 0)]);
    const size = Math.hypot(...minus(box.slice(3), box.slice(0, 3)));
    return {
      drawn: mill.balls, runs: runs(mill), bodies, motions: mill.motions, carrier, poses, colours,
      edges: { lines: Float32Array.from(shells.flatMap(sharp)), width: 0.0015 * size },
      hulls: [carrier < 0 ? vessel : swept, vessel], gravity: mill.gravity, slice: mill.slice, ...views(mill),
    };
  };
})();

class EngineSource {
  #worker; #ready; #colours;

  /** script: text of engine.js and worker.js; bytes: of the module; colours: of speeds, 256 times red, green, blue */
  constructor(script, bytes, colours) {
    this.live = true;
    /** @type {(message: any) => void} */
    this.on = () => {};
    this.#colours = colours;
    const place = URL.createObjectURL(new Blob([script], { type: 'text/javascript' }));
    this.#worker = new Worker(place);
    this.#ready = /** @type {Promise<void>} */ (new Promise((resolve, reject) => {
      this.#worker.onerror = (fault) => reject(new Error(fault.message));
      this.#worker.onmessage = ({ data }) => { if (data.type === 'ready') resolve(); this.#hear(data); };
    }));
    this.#ready.catch((fault) => this.on({ type: 'failed', lines: [fault.message] }));
    this.#ask({ task: 'start', bytes });
  }

  #ask(message) {
    this.#worker.postMessage(message);
  }

  #hear(data) {
    if (data.type === 'mill') {
      const { mill, outlines, state } = data;
      this.on({ ...mill, type: 'mill', head: millHead(mill, outlines, state, this.#colours) });
    } else if (data.type !== 'ready') {
      this.on(data);
      if (data.type === 'state') this.#ask({ task: 'seen' });
    }
  }

  /** Builds the mill of a deck; it is paused. set: lines SECTION.KEY=VALUE that replace values of the deck. */
  load(deck, files = new Map(), set = []) {
    this.#ask({ task: 'load', deck, set, files });
  }

  /** Goes on; factor: simulated seconds a second, or Infinity: as fast as possible */
  run({ factor }) {
    this.#ask({ task: 'run', factor });
  }

  pause() {
    this.#ask({ task: 'pause' });
  }

  /** Goes on for a time [s], and pauses */
  advance(by) {
    this.#ask({ task: 'advance', by });
  }
}
