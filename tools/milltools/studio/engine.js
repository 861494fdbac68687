/* The engine of millsim, compiled to WebAssembly (src/web), with files in memory: the functions of WASI preview 1 that
   the C library calls. Runs in a worker, or in node for tests. Numbers are in SI units. */
'use strict';

/** A wrong deck, or a run that failed: `lines` are the messages of millsim. */
class MillFault extends Error {
  constructor(lines) {
    super(lines.join('\n'));
    this.lines = lines;
  }
}

class MillEngine {
  static OK = 0;
  static ENDED = 4; // enum mill_status

  #module; #memory; #open = new Map(); #files = new Map(); #utf8 = new TextDecoder();

  /** Promise of an engine; `bytes`: of the module. */
  static async start(bytes) {
    const engine = new MillEngine();
    const { instance } = await WebAssembly.instantiate(bytes, { wasi_snapshot_preview1: engine.#wasi() });
    engine.#module = /** @type {any} */ (instance.exports);
    engine.#memory = engine.#module.memory;
    engine.#module._initialize();
    return engine;
  }

  #view() {
    return new DataView(this.#memory.buffer);
  }

  #text(at, length) {
    return this.#utf8.decode(new Uint8Array(this.#memory.buffer, at, length));
  }

  /** The files of the module: those of #files, in the folder "/". */
  #wasi() {
    const SUCCESS = 0, BADF = 8, NOENT = 44; // errno of WASI
    const ROOT = 3; // descriptor of the only folder
    const vectors = (at, count) => Array.from({ length: count }, (_, k) =>
      new Uint8Array(this.#memory.buffer, this.#view().getUint32(at + 8 * k, true), this.#view().getUint32(at + 8 * k + 4, true)));
    const kind = (fd) => (fd === ROOT ? 3 : this.#open.has(fd) ? 4 : fd < 3 ? 2 : 0); // folder, file, terminal
    return {
      clock_time_get: (_clock, _precision, to) => {
        this.#view().setBigUint64(to, BigInt(Math.round(performance.now() * 1e6)), true);
        return SUCCESS;
      },
      fd_prestat_get: (fd, to) => {
        if (fd !== ROOT) return BADF;
        this.#view().setUint32(to, 0, true);
        this.#view().setUint32(to + 4, 1, true);
        return SUCCESS;
      },
      fd_prestat_dir_name: (_fd, to) => {
        this.#view().setUint8(to, 47); // "/"
        return SUCCESS;
      },
      fd_fdstat_get: (fd, to) => {
        if (!kind(fd)) return BADF;
        new Uint8Array(this.#memory.buffer, to, 24).fill(0);
        this.#view().setUint8(to, kind(fd));
        for (const right of [8, 16]) this.#view().setBigUint64(to + right, ~0n, true);
        return SUCCESS;
      },
      fd_filestat_get: (fd, to) => {
        if (!kind(fd)) return BADF;
        new Uint8Array(this.#memory.buffer, to, 64).fill(0);
        this.#view().setUint8(to + 16, kind(fd));
        this.#view().setBigUint64(to + 32, BigInt(this.#open.get(fd)?.bytes.length ?? 0), true);
        return SUCCESS;
      },
      path_open: (_fd, _flags, path, length, _how, _rights, _inherited, _state, to) => {
        const bytes = this.#files.get(this.#text(path, length));
        if (!bytes) return NOENT;
        let fd = ROOT + 1;
        while (this.#open.has(fd)) fd += 1;
        this.#open.set(fd, { bytes, at: 0 });
        this.#view().setUint32(to, fd, true);
        return SUCCESS;
      },
      fd_read: (fd, at, count, to) => {
        const file = this.#open.get(fd);
        if (!file) return BADF;
        let read = 0;
        for (const room of vectors(at, count)) {
          const part = file.bytes.subarray(file.at, file.at + room.length);
          room.set(part);
          file.at += part.length;
          read += part.length;
        }
        this.#view().setUint32(to, read, true);
        return SUCCESS;
      },
      fd_write: (_fd, at, count, to) => {
        this.#view().setUint32(to, vectors(at, count).reduce((sum, part) => sum + part.length, 0), true);
        return SUCCESS;
      },
      fd_close: (fd) => (this.#open.delete(fd) ? SUCCESS : BADF),
      fd_seek: () => 70, // files are read from begin to end
      fd_fdstat_set_flags: () => SUCCESS,
      poll_oneoff: () => 52, // not supported: there are no pipes
      proc_exit: (status) => { throw new MillFault([`the engine ended with status ${status}`]); },
    };
  }

  #said() {
    const at = this.#module.mill_web_text();
    const bytes = new Uint8Array(this.#memory.buffer);
    return this.#text(at, bytes.indexOf(0, at) - at);
  }

  /** The messages of millsim; the names of files are as the page knows them. */
  #fault() {
    return new MillFault(this.#said().trim().split('\n').map((line) => line.replace(/^\/deck\.ini(:|$)/, 'deck$1')));
  }

  #told(status) {
    if (status !== MillEngine.OK) throw this.#fault();
    return JSON.parse(this.#said());
  }

  #doubles(at, count) {
    return new Float64Array(this.#memory.buffer, at, count).slice();
  }

  /** Builds the mill of a deck: an object as src/web/web.h says. `set`: lines SECTION.KEY=VALUE; `files`: Map of name
      and bytes. Throws MillFault; the mill before then goes on. */
  load(deck, set = [], files = new Map()) {
    const bytes = new TextEncoder();
    this.#files = new Map(files).set('deck.ini', bytes.encode(deck)).set('set', bytes.encode(set.join('\n')));
    const mill = this.#told(this.#module.mill_web_load());
    this.kinds = mill.kinds;
    this.motions = mill.motions;
    this.balls = mill.balls;
    this.bins = mill.bins;
    this.edges = this.#doubles(this.#module.mill_web_edges(), this.bins + 1);
    return mill;
  }

  /** Memory of the module [B] */
  get memory() {
    return this.#memory.buffer.byteLength;
  }

  /** Simulated time [s] */
  get time() {
    return this.#module.mill_web_time();
  }

  /** Goes on until a simulated time, or for a number of events. true: the run is over. */
  run(until, events) {
    const status = this.#module.mill_web_run(until, events);
    if (status === MillEngine.OK || status === MillEngine.ENDED) return status === MillEngine.ENDED;
    throw this.#fault();
  }

  /** The present state; positions and speeds of the balls are copies. */
  state() {
    const { kinds, motions, balls } = this, count = 9 + 2 * kinds.length + 13 * motions.length;
    const all = this.#doubles(this.#module.mill_web_state(), count);
    let at = 9;
    const take = (many) => all.subarray(at, at += many);
    const [time, contacts, kinetic, rotational, potential, start, work, error, turnover] = all;
    const state = { time, contacts, energy: { kinetic, rotational, potential, start }, work, balance: { error, turnover },
      dissipation: take(kinds.length), collisions: take(kinds.length), motionWork: take(motions.length),
      poses: Float32Array.from(take(12 * motions.length)) };
    const address = this.#module.mill_web_balls(); // which may make a new buffer
    const ball = new Float32Array(this.#memory.buffer, address, 4 * balls);
    state.positions = new Float32Array(3 * balls);
    state.speeds = new Float32Array(balls);
    for (let k = 0; k < balls; k++) {
      for (let j = 0; j < 3; j++) state.positions[3 * k + j] = ball[4 * k + j];
      state.speeds[k] = ball[4 * k + 3];
    }
    return state;
  }

  /** {sample_from, settled, statistics: as in `millsim --json`, spectrum: {edges, count, dissipation: by kind}} */
  results() {
    const told = this.#told(this.#module.mill_web_results());
    const { kinds, bins } = this, all = this.#doubles(this.#module.mill_web_spectrum(), 2 * kinds.length * bins);
    const spectrum = { edges: this.edges, count: {}, dissipation: {} };
    for (const name of ['count', 'dissipation']) {
      const sum = new Float64Array(bins);
      kinds.forEach((kind, k) => {
        const from = (2 * k + (name === 'dissipation' ? 1 : 0)) * bins;
        spectrum[name][kind] = all.slice(from, from + bins);
        spectrum[name][kind].forEach((value, i) => { sum[i] += value; });
      });
      spectrum[name].all = sum;
    }
    return { ...told, spectrum };
  }

  /** {points, corners, kind} of what a motion carries (-1: none), in its frame */
  outline(motion) {
    const at = this.#module.mill_web_outline(motion);
    if (!at) throw new MillFault(['out of memory']);
    const [points, triangles, point, corner, kind] = new Uint32Array(this.#memory.buffer, at, 5);
    return { points: new Float32Array(this.#memory.buffer, point, 3 * points).slice(),
      corners: new Uint32Array(this.#memory.buffer, corner, 3 * triangles).slice(),
      kind: new Uint8Array(this.#memory.buffer, kind, triangles).slice() };
  }
}

