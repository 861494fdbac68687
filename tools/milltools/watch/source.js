/* The source of a page that watches a run: asks the server of `mill watch` for what is new, and plays the states that
   arrive evenly over the time until the next ones.

     const source = new WatchSource('/TOKEN/');
     source.on = (message) => ...;    // begins to ask; messages are {type: 'mill' | 'state' | 'results' | 'progress' | 'failed', ...}
     source.run(); source.pause();    // shows states, holds them; run() after the end of a run plays it again
     source.live                      // false: a run is watched, its deck cannot be changed
*/
'use strict';

class WatchSource {
  static OFTEN = 500; // [ms] between two questions about a run that goes on,
  static SELDOM = 3000; // about one that has ended or cannot be reached
  static FIRST = 40; // [ms] shortest time between two states
  static MOST = 600; // states that wait at most
  static LATE = 60; // states that are left of them after a pause, if the run goes on
  static KINDS = { f4: Float32Array, f8: Float64Array, u4: Uint32Array, u1: Uint8Array };

  #heard;
  #place;
  #mill = '';
  #since = -1;
  #seen = -1;
  #queue = [];
  #gap = WatchSource.FIRST;
  #paused = true; // but the first state is shown
  #shown = false;
  #failed = '';
  #over = false; // the last state of an ended run was shown
  #ended = false;
  #fetched = false; // all states of an ended run have been asked for

  constructor(place) {
    this.#place = place;
    this.live = false;
  }

  set on(heard) {
    const first = !this.#heard;
    this.#heard = heard;
    if (!first) return;
    this.#ask();
    this.#play();
  }

  get on() { return this.#heard; }

  /** Nothing to load: the server knows its run. */
  load() {}

  run() {
    if (this.#paused && !this.#ended) this.#queue.splice(0, this.#queue.length - WatchSource.LATE);
    this.#paused = false;
    if (!this.#over) return;
    this.#over = false; // once more, from its first state
    this.#since = 0;
    this.#fetched = false;
  }

  pause() { this.#paused = true; }

  /** A value of the server's JSON: {f4: base64} and the like as typed arrays. */
  static decode(value) {
    if (Array.isArray(value)) return value.map(WatchSource.decode);
    if (value === null || typeof value !== 'object') return value;
    const [[name, text] = []] = Object.entries(value);
    if (Object.keys(value).length === 1 && typeof text === 'string' && Object.hasOwn(WatchSource.KINDS, name)) {
      const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
      return new WatchSource.KINDS[name](bytes.buffer);
    }
    return Object.fromEntries(Object.entries(value).map(([key, one]) => [key, WatchSource.decode(one)]));
  }

  async #get(name) {
    const answer = await fetch(this.#place + name, { cache: 'no-store' });
    if (!answer.ok) throw new Error(`${answer.status} ${answer.statusText}`);
    return WatchSource.decode(await answer.json());
  }

  async #ask() {
    let wait = WatchSource.OFTEN;
    try {
      wait = await this.#once();
    } catch (fault) { // the command was ended, or the computer sleeps
      wait = WatchSource.SELDOM;
      this.#heard({ type: 'progress', left: null, done: this.done ?? 0, note: `no news: mill watch has ended or does not answer (${fault.message})` });
    }
    setTimeout(() => this.#ask(), wait);
  }

  /** Asks once; resolves to the time to wait [ms]. */
  async #once() {
    const since = this.#since;
    const told = await this.#get(`state?since=${since}&seen=${this.#seen}`);
    if (told.mill && told.mill !== this.#mill) return this.#begin();
    for (const message of told.news) this.#tell(message);
    this.#seen = told.seen;
    if (since !== this.#since) return 0; // meanwhile asked to play it again
    this.#since = told.next;
    this.#ended = told.ended;
    this.#fetched = told.ended && !told.states.length;
    if (told.states.length) {
      this.#queue.push(...told.states);
      this.#queue.splice(0, this.#queue.length - WatchSource.MOST);
      const all = told.ended ? told.states.length : this.#queue.length; // those that still wait have to be shown as well
      this.#gap = Math.max((1000 * told.every) / all, WatchSource.FIRST);
    }
    if (!told.ended) return WatchSource.OFTEN;
    if (this.#fetched) return WatchSource.SELDOM;
    // the next states are asked for when a few are left
    return Math.max((this.#queue.length - 10) * this.#gap, 0);
  }

  /** Another mill: from its beginning. Resolves to the time to wait [ms]. */
  async #begin() {
    const { mill, message } = await this.#get('mill.json');
    if (!message) return WatchSource.OFTEN;
    this.#tell(message);
    if (message.type !== 'mill') return WatchSource.SELDOM;
    Object.assign(this, { done: 0 });
    this.#mill = mill;
    this.#since = this.#seen = -1;
    this.#queue = [];
    this.#over = this.#shown = false;
    return 0;
  }

  #tell(message) {
    if (message.type === 'progress') {
      this.done = message.done;
      message.left = null; // the note has it in words, with both ends
    }
    if (message.type === 'failed') {
      const lines = message.lines.join('\n');
      if (lines === this.#failed) return;
      this.#failed = lines;
    }
    this.#heard(message);
  }

  #play() {
    if ((!this.#paused || !this.#shown) && this.#queue.length) {
      this.#shown = true;
      const state = this.#queue.shift();
      this.#heard(state);
      if (!this.#queue.length && this.#fetched) this.#over = true;
    }
    setTimeout(() => this.#play(), this.#gap);
  }
}
