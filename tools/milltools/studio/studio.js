/* The page: decks come in, messages of the source are shown, and buttons, fields and keys do their work.

   For scripts and tests, window.millStudio is the page: ready (promise: a mill is there), source, deck (its text),
   stage, record, frozen, playing, open(text, files), link() (promise of the address with the design). */
'use strict';

const MillStudio = (() => {
  const WAIT = 300; // [ms] from a change to a new mill
  const SHOWN = 300; // [ms] between two updates of the numbers
  const ENDLESS = ['run.time=10000 s', 'output.series=1 s', 'output.frames=0 s']; // the page decides when it ends; nothing is stored
  const SLOW = [1, 2, 5, 10, 20, 50, 100].map((n) => 1 / n), PERIOD = 1.2; // [s] of the reader's time for a period of the mill
  const LACKING = 'This page simulates the mill in the browser. That needs WebAssembly and DecompressionStream, which this browser does not have: '
    + 'Chrome and Edge from version 91, Firefox from 113 and Safari from 16.4 have both.';

  const part = (id) => document.getElementById(id);
  const W = MillWords;

  /** Changes what follows # in the address, without a new entry in the history. */
  function address(hash) {
    try {
      history.replaceState(null, '', hash || location.pathname + location.search);
    } catch { // some browsers do not allow it for a file
      location.hash = hash;
    }
  }

  /** Data of the page: text(id), and unpacked(id): promise of the bytes of base64 of a gzip stream. */
  const data = {
    text: (id) => part(id).textContent,
    bytes: (id) => Uint8Array.from(atob(part(id).textContent.trim()), (c) => c.charCodeAt(0)),
    async unpacked(id) {
      const stream = new Blob([data.bytes(id)]).stream().pipeThrough(new DecompressionStream('gzip'));
      return new Uint8Array(await new Response(stream).arrayBuffer());
    },
  };

  class Studio {
    source; deck; draft; origin; opened; name; // texts of decks: built, as fields have it, as it was opened; the preset
    record; frozen; asked; next; // results; of the design that is compared; what is being built, and what comes then
    files = new Map();
    broken = false; waiting = false; fresh = false;
    /** @type {(there: boolean) => void} */
    settle;

    constructor() {
      this.presets = JSON.parse(data.text('presets'));
      this.playing = !matchMedia('(prefers-reduced-motion: reduce)').matches;
      this.ready = new Promise((resolve) => { this.settle = resolve; });
      this.show = new MillShow.Show();
      this.panel = new MillPanel.Panel({ sliders: part('sliders'), table: part('keys-table'), faults: part('faults') }, (make, id) => this.change(make, id));
      this.stage = new MillStage.Stage({ canvas: document.querySelector('.mp-canvas'), box: document.querySelector('.mp-stage'), lacking: part('lacking'), say: (text) => this.say(text) });
      this.stage.onshow = ({ time }) => MillShow.write('time', `t = ${time < 1 ? `${(1e3 * time).toFixed(2)} ms` : `${time.toFixed(4)} s`}`);
      this.stage.onscale = (limit) => this.scale(limit);
      part('preset').replaceChildren(...this.presets.map(({ name, title }) => new Option(title, name)), Object.assign(new Option('own deck', ''), { hidden: true }));
      this.bind();
      setInterval(() => this.refresh(), SHOWN);
    }

    async start(make) {
      if (typeof WebAssembly === 'undefined' || typeof DecompressionStream === 'undefined') {
        document.body.classList.add('lacking');
        part('finding').textContent = 'This browser cannot simulate the mill';
        this.settle(false);
        return this.say(LACKING);
      }
      this.source = await make(data);
      this.source.on = (message) => this.hear(message);
      this.panel.live = this.source.live;
      document.body.classList.toggle('watch', !this.source.live);
      document.querySelector('.watching').hidden = this.source.live;
      if (!this.source.live) return undefined;
      addEventListener('hashchange', () => this.linked());
      if (await this.linked()) return undefined;
      const own = JSON.parse(data.text('own'));
      if (own) return this.open(own.text, new Map(Object.entries(own.files).map(([name, text]) => [name, Uint8Array.from(atob(text), (c) => c.charCodeAt(0))])));
      return this.preset(this.presets[0].name, part('notice').textContent);
    }

    // ---- messages of the source

    hear(message) {
      ({ mill: () => this.mill(message), state: () => this.state(message), results: () => this.results(message), failed: () => this.failed(message.lines),
        progress: () => this.progress(message) })[message.type]?.();
    }

    mill(mill) {
      const asked = this.asked ?? { text: mill.deck, fresh: false };
      this.asked = null;
      this.busy(false);
      const another = !this.record || this.record.mill.kinds.join() !== mill.kinds.join() || asked.fresh;
      Object.assign(this, { deck: asked.text, record: new MillResults.Record(mill), broken: false });
      const later = this.next || this.waiting; // the design has changed again meanwhile
      if (!later) this.draft = this.deck;
      Object.assign(mill, { text: this.deck, sample_from: this.#second(mill.keys) });
      if (another) this.show.begin();
      this.stage.mill(mill.head);
      this.cameras(mill.head);
      this.panel.show(later ? this.draft : this.deck, mill.keys);
      part('reset').hidden = !this.source.live || this.deck === this.origin;
      this.notes([]);
      this.show.all(this.record, this.frozen);
      this.settle(true);
      if (this.playing) this.play();
      else this.button();
      if (this.next) this.build(...this.next);
    }

    /** What the engine says of the deck, and of the results so far. */
    notes(notes) {
      const lines = [...this.record.mill.warnings, ...notes], now = lines.join('\n');
      if (now === this.told) return;
      this.told = now;
      part('warnings').replaceChildren(...lines.map((line) => Object.assign(document.createElement('li'), { textContent: line })));
      part('warnings').hidden = !lines.length;
    }

    /** [s] from which on there are statistics, or null if the run finds it. */
    #second(keys) {
      const key = keys.find((one) => one.section === 'run' && one.key === 'sample_from');
      return key ? MillDeck.measured(key.value).numbers[0] ?? null : null;
    }

    state(state) {
      if (!this.record || this.asked?.sent) return;
      this.record.see(state);
      this.stage.state(state);
      MillShow.write('reached', this.playing && state.factor > 0 ? `reached: ${state.factor >= 0.995 ? W.number(state.factor, 2) : `1/${W.number(1 / state.factor, 2)}`} of real time` : '');
      this.fresh = true;
      if (state.ended) this.pause(false);
    }

    results(results) {
      if (!this.record || this.asked?.sent) return;
      if (results.sample_from !== undefined && results.settled !== 0) this.record.mill.sample_from = results.sample_from;
      this.record.learn(results);
      if (results.notes) this.notes(results.notes);
      this.fresh = true;
      if (this.playing && this.factor !== this.pace) this.play();
    }

    failed(lines) {
      const { asked } = this;
      this.asked = null;
      this.busy(false);
      this.settle(true);
      if (!asked) {
        this.playing = false;
        this.button();
        return this.say(lines.join('\n'));
      }
      this.broken = true;
      this.panel.fault(lines, asked.id);
      part('reset').hidden = false;
      if (asked.opened) this.say(`${this.name ?? 'This deck'} cannot be simulated${this.record ? '; the mill before it goes on' : ''}:\n${lines.join('\n')}`);
      if (this.record && this.playing) this.play(); // the mill before goes on
      if (this.next) this.build(...this.next);
      return undefined;
    }

    progress({ done, left, note }) {
      part('done').value = done;
      MillShow.write('left', [`${Math.floor(100 * done)} %`, left === null ? '' : `${W.duration(left)} left`, note].filter(Boolean).join(', '));
    }

    refresh() {
      if (!this.fresh || !this.record) return;
      this.fresh = false;
      this.show.all(this.record, this.frozen);
    }

    // ---- the design

    /** A change of the deck by a field: a new mill is built when no other change follows at once. */
    change(make, id) {
      this.draft = make(this.draft);
      clearTimeout(this.timer);
      this.waiting = true;
      this.timer = setTimeout(() => { this.waiting = false; this.build(this.draft, { id }); }, WAIT);
    }

    /** Builds the mill of a deck, after the one that is being built. */
    build(text, options = {}) {
      this.next = null;
      if (this.asked) {
        this.next = [text, options];
        return;
      }
      this.asked = { text, sent: true, ...options };
      this.busy(true);
      this.source.load(text, this.files, ENDLESS);
    }

    /** The note that a mill is being built comes late, so that it does not flicker. */
    busy(now) {
      clearTimeout(this.noted);
      part('building').hidden = true;
      if (now) this.noted = setTimeout(() => { part('building').hidden = false; }, 250);
    }

    /** Opens a deck as it is; `files`: Map of name and bytes, of what it names. */
    open(text, files = new Map(), preset = '', remark = '') {
      clearTimeout(this.timer);
      this.waiting = false;
      const clean = text.replace(/^\ufeff/, '').replace(/\r\n?/g, '\n');
      Object.assign(this, { files, origin: this.presets.find((one) => one.name === preset)?.text ?? clean, draft: clean, opened: preset });
      part('preset').value = preset;
      this.say(remark);
      this.build(clean, { opened: true, fresh: true });
      return this.ready;
    }

    preset(name, remark = '') {
      const found = this.presets.find((one) => one.name === name);
      address('');
      return this.open(found.text, new Map(), name, remark);
    }

    /** Opens the design of the address; false if there is none. */
    async linked() {
      const packed = /^#design=(.+)$/.exec(location.hash)?.[1];
      if (!packed) return false;
      try {
        const { text, preset, remark } = await MillDeck.unpack(packed, this.presets);
        this.open(text, new Map(), preset ?? '', remark);
        return true;
      } catch (fault) {
        this.say(fault.message);
        return false;
      }
    }

    async link() {
      const packed = await MillDeck.pack(this.deck, this.presets.find((one) => one.name === this.opened));
      return `${location.href.replace(/#.*/, '')}#design=${packed}`;
    }

    async copy() {
      const link = await this.link();
      address(`#design=${link.split('#design=')[1]}`);
      const files = this.files.size ? ' Its files are not in the link: send them too.' : '';
      try {
        await navigator.clipboard.writeText(link);
        this.say(`The link is copied: ${link.length} characters.${files}`);
      } catch {
        this.say(`Copy the address of this page: it holds the design.${files}`);
      }
    }

    /** Files that were dropped or chosen: one deck, and what it names. */
    async take(list) {
      const given = [...list], all = new Map(); // the list of what was dropped is soon empty
      for (const file of given) all.set(file.name, new Uint8Array(await file.arrayBuffer()));
      const decks = [...all.keys()].filter((name) => /\.(ini|deck|txt)$/i.test(name)), deck = decks.find((name) => /\.ini$/i.test(name)) ?? (all.size === 1 && decks[0]);
      if (!deck) { // files for the deck that is there
        if (!this.deck) return;
        this.files = new Map([...this.files, ...all]);
        this.say(`Added: ${[...all.keys()].join(', ')}.`);
        this.build(this.draft, { fresh: true, opened: true });
        return;
      }
      const text = new TextDecoder().decode(all.get(deck));
      all.delete(deck);
      address('');
      this.name = deck;
      this.open(text, all);
    }

    save() {
      const link = document.createElement('a');
      link.href = URL.createObjectURL(new Blob([this.deck], { type: 'text/plain' }));
      link.download = this.opened ? `${this.opened}.ini` : this.name ?? 'mill.ini';
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    }

    freeze() {
      this.frozen = this.record.frozen();
      part('clear').hidden = part('frozen-name').hidden = false;
      MillShow.write('frozen-name', `Frozen: ${part('preset').selectedOptions[0].text} after ${W.quantity(this.record.state?.time ?? 0, 's')}. Change the design, and compare.`);
      this.show.all(this.record, this.frozen);
    }

    clear() {
      this.frozen = undefined;
      part('clear').hidden = part('frozen-name').hidden = true;
      this.show.all(this.record);
    }

    // ---- the picture

    /** Simulated seconds a second. By itself: as fast as possible until the error of the power is known, then slow
        enough to see the mill turn. */
    get factor() {
      const chosen = part('speed').value, { period } = this.record.mill;
      if (chosen !== 'auto') return chosen === 'fast' ? Infinity : Number(chosen);
      if (this.record.power().error === null || !(period > 0)) return Infinity;
      return SLOW.find((factor) => period / factor >= PERIOD) ?? SLOW.at(-1);
    }

    play() {
      this.playing = true;
      this.button();
      this.pace = this.factor;
      this.source.run({ factor: this.pace });
    }

    pause(tell = true) {
      this.playing = false;
      this.button();
      if (tell) this.source.pause();
    }

    button() {
      part('play').textContent = this.playing ? 'Pause' : 'Play';
      part('play').classList.toggle('mp-playing', this.playing);
      if (!this.playing) MillShow.write('reached', '');
    }

    /** One state on: of those that were shown, else the mill goes on for a sixtieth of a second of slow motion. */
    step(by) {
      if (this.playing) this.pause();
      if (!this.stage.step(by) && by < 0) this.source.advance?.(Math.min(this.factor, 0.02) / 60);
    }

    cameras(head) {
      const camera = part('camera'), chosen = camera.value, options = [new Option('laboratory', '')];
      head.motions.forEach((name, k) => options.push(new Option(k === head.carrier ? `on the container (${name})` : `on ${name}`, name)));
      camera.replaceChildren(...options);
      const { view } = this.stage;
      camera.value = view.riding ? head.motions[view.on] : chosen && head.motions.includes(chosen) && view.riding ? chosen : '';
    }

    ride() {
      const on = this.record.mill.head.motions.indexOf(part('camera').value);
      this.stage.ride(on >= 0, on >= 0 ? on : this.record.mill.head.carrier);
    }

    scale(limit) {
      const { colours } = this.record.mill.head, step = limit / 4;
      const stops = Array.from({ length: 16 }, (_, k) => `rgb(${colours.slice(51 * k, 51 * k + 3).join(',')})`);
      part('scale').style.background = `linear-gradient(90deg,${stops})`;
      part('scale').setAttribute('aria-label', `Colours of the balls: speed from 0, dark blue, to ${W.quantity(limit, 'm/s')} and more, yellow`);
      part('scale-ticks').replaceChildren(...[0, 2, 4].map((k) => {
        const tick = document.createElement('span');
        tick.textContent = k < 4 ? W.number(k * step) : `≥ ${W.number(limit)} m/s`;
        tick.style.left = `${25 * k}%`;
        return tick;
      }));
    }

    say(text) {
      part('notice').textContent = text;
      part('notice').hidden = !text;
    }

    // ---- buttons, keys, dropped files

    bind() {
      const on = (id, event, act) => part(id).addEventListener(event, act);
      on('preset', 'change', () => this.preset(part('preset').value));
      on('open', 'click', () => part('files').click());
      on('files', 'change', async () => { await this.take(part('files').files); part('files').value = ''; });
      on('download', 'click', () => this.save());
      on('link', 'click', () => this.copy());
      on('help', 'click', () => part('keys').showModal());
      on('play', 'click', () => (this.playing ? this.pause() : this.play()));
      on('restart', 'click', () => this.build(this.deck, {}));
      on('speed', 'change', () => { if (this.playing) this.play(); });
      on('camera', 'change', () => this.ride());
      on('freeze', 'click', () => this.freeze());
      on('clear', 'click', () => this.clear());
      on('reset', 'click', () => {
        clearTimeout(this.timer);
        this.draft = this.broken ? this.deck : this.origin; // first what was refused, then all
        this.build(this.draft, {});
      });
      for (const id of ['threshold', 'spectrum-what', 'spectrum-kinds']) on(id, 'change', () => this.record && this.show.all(this.record, this.frozen));
      for (const button of document.querySelectorAll('[data-view]')) button.addEventListener('click', () => this.stage.look(button.dataset.view));
      document.addEventListener('keydown', (event) => this.key(event));
      let inside = 0;
      const over = (event, by) => {
        if (!event.dataTransfer?.types.includes('Files') || !this.source?.live) return;
        event.preventDefault();
        inside = Math.max(0, inside + by);
        part('dropping').hidden = inside === 0;
      };
      document.addEventListener('dragenter', (event) => over(event, 1));
      document.addEventListener('dragleave', (event) => over(event, -1));
      document.addEventListener('dragover', (event) => over(event, 0));
      document.addEventListener('drop', (event) => {
        over(event, -inside);
        if (this.source?.live) this.take(event.dataTransfer.files);
      });
    }

    key(event) {
      if (event.ctrlKey || event.altKey || event.metaKey || part('keys').open || !this.record) return;
      const { target } = event, picture = target === this.stage.canvas;
      if (!picture && target !== document.body) return;
      const preset = this.source.live && this.presets[Number(event.key) - 1];
      const act = { ' ': () => (this.playing ? this.pause() : this.play()), ',': () => this.step(1), '.': () => this.step(-1), '?': () => part('keys').showModal() }[event.key]
        ?? (preset && (() => this.preset(preset.name)));
      if (act) act();
      else if (!picture || !this.stage.key(event.key)) return;
      event.preventDefault();
    }
  }

  /** Starts the page; make(data): promise of its source. */
  async function start(make) {
    const studio = window.millStudio = new Studio();
    try {
      await studio.start(make);
    } catch (fault) {
      studio.settle(false);
      studio.say(`The page could not start: ${fault.message}`);
    }
  }

  return { start };
})();
