/* The 3D player of the report: starts every <figure class="mill-player"> of the page and handles its buttons and keys.

   For scripts and tests, window.millPlayers[k] is the k-th player of the page:
     ready           promise: true when the player is drawn, false if the still picture is shown instead
     frames, frame   number of frames, index of the frame shown
     show(k)         pauses and shows frame k            play(), pause(), playing
     at(t)           pauses and shows the time t [s]     clock  the time shown [s]
     colourBy(name)  "speed", "spin", "energy", or a quantity of wear: then a promise of the worn parts
     look(name)      "front", "three-quarter", "end"
     positions()     centres of the balls as drawn, Float32Array (n, 3) [m]
     levels()        values for their colours, Uint8Array (n,): 255 is the end of the scale
     flashes()       number of flashes of impacts as drawn
     pose(name)      pose of a motion as drawn, three rows of four: a point p is at rotation p + centre
     ride(riding)    sets whether the camera moves with the container
     draws           pictures drawn so far
     link            what it shares with other players, or undefined

   Players in a <div class="mp-linked"> have one clock, one camera and the controls of the first one. The clock counts
   turns (head.turns), so all show the same angle; if nothing turns, or no angle is common to all, it counts seconds from
   each player's first frame. */
'use strict';

(() => {
  const TURN = Math.PI / 36; // by a key
  const FIRST_VIEW = 'front';
  const QUICK = 40; // [ms] the player starts by itself if a picture takes less
  const HICCUP = 300; // [ms] a longer time between two pictures counts as this
  const NO_WEBGL = 'The 3D picture needs WebGL 2, which this browser does not offer here.';
  const NO_UNPACKING = 'The 3D picture needs a browser from 2023 or later (DecompressionStream).';

  class Player {
    frame = 0; playing = false; draws = 0; visible = false;
    pace = 1; // own seconds in a second of the clock's player
    /** @type {(drawn: boolean) => void} */
    settle;
    link; by; // the Link, if there is one; the quantity of the colours

    constructor(figure) {
      const bar = figure.querySelector('.mp-controls'); // of linked players the first one's is moved out of the figure
      const part = (name) => (name === 'controls' ? bar : figure.querySelector(`.mp-${name}`) ?? bar?.querySelector(`.mp-${name}`));
      this.figure = figure;
      this.part = part;
      this.flashBox = part('flashes');
      this.ready = new Promise((resolve) => { this.settle = resolve; });
      const head = part('head');
      if (!head) { // nothing is stored: the page says so
        this.settle(false);
        return;
      }
      this.head = JSON.parse(head.textContent);
      this.frames = this.head.times.length;
      [this.by] = this.head.values;
      this.frame = this.head.first;
      this.clock = this.head.times[this.frame];
      this.watch();
    }

    /** Nothing is unpacked or drawn before the player is first seen, or while it is out of sight. */
    watch() {
      new IntersectionObserver((entries) => {
        this.visible = entries[entries.length - 1].isIntersecting;
        if (!this.visible) return;
        for (const one of this.link?.players ?? [this]) {
          if (!one.started) one.start().catch((fault) => one.give_up(`The 3D picture failed: ${fault.message}.`));
        }
        if (this.view) this.draw();
        this.first.run();
      }, { rootMargin: '100px' }).observe(this.part('stage'));
    }

    /** The player with the clock and the controls: this one, or the first of those that are linked. */
    get first() { return this.link?.players[0] ?? this; }

    /** First and last frame that it plays. */
    get range() { return this.link && this.first === this ? this.link.range : [0, this.frames - 1]; }

    get seen() { return this.link ? this.link.players.some((one) => one.visible) : this.visible; }

    async start() {
      this.started = true;
      if (typeof DecompressionStream === 'undefined') return this.give_up(NO_UNPACKING);
      const canvas = this.canvas = this.part('canvas');
      const context = canvas.getContext('webgl2', { alpha: true, antialias: true });
      if (!context) return this.give_up(NO_WEBGL);
      const { head } = this;
      const text = this.part('data').textContent;
      const frames = await Mill3D.unpack(text, head);
      this.view = new Mill3D.View(canvas, context, head, frames);
      this.view.name = FIRST_VIEW;
      this.view.riding = head.rides;
      this.part('controls').hidden = false;
      this.figure.classList.add('mp-live');
      this.bind();
      this.place();
      this.resize();
      const still = matchMedia('(prefers-reduced-motion: reduce)').matches;
      this.settle(true);
      this.link?.joined(this);
      if (still || this.frames < 2 || this.first !== this) return;
      await this.view.cost(); // the first one compiles
      if ((await this.view.cost()) * (this.link?.players.length ?? 1) < QUICK && !this.touched) this.play();
    }

    give_up(why) {
      this.pause();
      this.figure.classList.remove('mp-live');
      this.part('controls').hidden = true;
      this.say(why);
      this.settle(false);
    }

    say(text) {
      this.part('why').textContent = text;
      this.part('why').hidden = !text;
    }

    // ---- buttons, keys, surroundings

    bind() {
      const { part, view, canvas } = this;
      const on = (element, event, act) => element.addEventListener(event, (e) => { this.touched = true; act(e); });
      on(part('play'), 'click', () => (this.playing ? this.pause() : this.play()));
      on(part('slider'), 'input', () => this.show(Number(part('slider').value)));
      on(part('slow'), 'change', () => this.refresh());
      if (this.flashBox && this.first === this) on(this.flashBox, 'change', () => this.refresh());
      on(part('colour'), 'change', () => this.colourBy(part('colour').value));
      const camera = part('camera');
      if (camera) on(camera, 'change', () => this.ride(camera.value === 'riding'));
      for (const button of part('controls').querySelectorAll('[data-view]')) {
        on(button, 'click', () => this.look(button.dataset.view));
      }
      on(part('reset'), 'click', () => this.reset());
      on(canvas, 'keydown', (e) => this.key(e));
      view.controls.addEventListener('change', () => { this.draw(); this.link?.aim(this); });
      // the wheel scrolls the page until the picture is clicked
      part('stage').addEventListener('wheel', (e) => {
        if (document.activeElement !== canvas && !e.ctrlKey) e.stopPropagation();
      }, { capture: true, passive: true });
      canvas.addEventListener('pointerdown', () => {
        this.touched = true;
        this.before = view.stand();
        canvas.focus({ preventScroll: true });
      });
      // if a touch scrolls the page, undo its rotation of the mill
      canvas.addEventListener('pointercancel', () => view.moveTo(this.before));
      canvas.addEventListener('webglcontextlost', () => {
        this.lost = true;
        this.say('The graphics driver has stopped the 3D picture. It returns by itself, or when you reload the page.');
      });
      canvas.addEventListener('webglcontextrestored', () => {
        this.lost = false;
        this.say('');
        this.draw();
        this.run();
      });
      const full = part('full');
      full.hidden = !document.fullscreenEnabled;
      on(full, 'click', () => (document.fullscreenElement ? document.exitFullscreen() : (this.link?.frame ?? this.figure).requestFullscreen()));
      new ResizeObserver(() => this.resize()).observe(part('stage'));
      addEventListener('resize', () => this.resize()); // the device's pixels may have changed
      matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.ink());
      document.addEventListener('themechange', () => this.ink()); // the report's own choice of light and dark
      addEventListener('beforeprint', () => this.picture());
      this.ink();
    }

    key(event) {
      if (event.ctrlKey || event.altKey || event.metaKey) return;
      const { view, first } = this;
      const act = {
        ArrowLeft: () => view.turn(TURN, 0),
        ArrowRight: () => view.turn(-TURN, 0),
        ArrowUp: () => view.turn(0, TURN),
        ArrowDown: () => view.turn(0, -TURN),
        '+': () => view.zoom(1.1),
        '=': () => view.zoom(1.1),
        '-': () => view.zoom(1 / 1.1),
        ' ': () => (first.playing ? first.pause() : first.play()),
        ',': () => first.show(Math.max(0, first.frame - 1)),
        '.': () => first.show(Math.min(first.frames - 1, first.frame + 1)),
        Home: () => first.reset(),
      }[event.key];
      if (!act) return;
      event.preventDefault();
      act();
    }

    /** The page is dark if its text is light, whoever chose that. */
    ink() {
      const [r, g, b] = getComputedStyle(this.figure).color.match(/[\d.]+/g).map(Number);
      this.view.ink(0.3 * r + 0.6 * g + 0.1 * b > 128);
      this.draw();
    }

    resize() {
      const { clientWidth, clientHeight } = this.part('stage');
      if (!clientWidth || !clientHeight) return;
      this.view.resize(clientWidth, clientHeight, devicePixelRatio || 1);
      this.link?.level();
      this.draw();
    }

    /** For printing if there is no still picture: keeps the present view. */
    picture() {
      const image = this.part('still');
      if (image.dataset.own || this.lost) return;
      this.view.ink(false);
      this.view.draw();
      image.src = this.canvas.toDataURL('image/png');
      this.ink();
    }

    // ---- frames

    place() {
      this.link?.follow(this);
      const slow = Number(this.first.part('slow').value) * this.pace;
      this.view.place(this.frame, this.clock, this.by, this.flashBox?.checked ? this.head.seen * slow : 0);
      const text = this.link?.words() ?? this.label();
      const slider = this.part('slider');
      slider.value = this.frame;
      slider.setAttribute('aria-valuetext', text);
      this.part('time').textContent = text;
    }

    /** The time shown, in words. */
    label() {
      const { head, clock, frame } = this;
      return clock > head.times[frame] || this.first.playing && head.between
        ? `t = ${(1e3 * clock).toFixed(head.places + 1)} ms` : head.labels[frame];
    }

    /** Draws once at the browser's next picture, even after several calls. */
    draw() {
      if (this.asked || this.lost || !this.visible) return;
      this.asked = true;
      requestAnimationFrame(() => {
        this.asked = false;
        if (this.lost) return;
        this.view.draw();
        this.draws += 1;
      });
    }

    refresh() {
      this.place();
      this.draw();
    }

    show(frame) { this.at(this.head.times[frame]); }

    at(time) {
      this.pause();
      this.reach(time);
      this.refresh();
    }

    /** Sets the time shown: that of the last frame before it if nothing is drawn between frames. */
    reach(time) {
      const { times, between } = this.head, [begin, end] = this.range;
      const there = Math.min(Math.max(time, times[begin]), times[end]);
      this.frame = Math.max(0, times.findLastIndex((t) => t <= there + 1e-9));
      this.clock = between ? there : times[this.frame];
    }

    play() {
      this.playing = true;
      this.button();
      this.begin();
      this.run();
    }

    pause() {
      this.playing = false;
      this.button();
    }

    button() {
      const button = this.part('play');
      if (!button) return;
      button.textContent = this.playing ? 'Pause' : 'Play';
      button.classList.toggle('mp-playing', this.playing);
    }

    /** Simulated time continues from the time shown. */
    begin() {
      this.simulated = this.clock;
      this.last = null;
    }

    run() {
      if (!this.playing || this.looping) return;
      this.looping = true;
      this.begin();
      const tick = (now) => {
        this.looping = this.playing && this.seen && !this.lost;
        if (!this.looping) return;
        this.advance(now);
        requestAnimationFrame(tick);
      };
      requestAnimationFrame(tick);
    }

    advance(now) {
      const { times, interval, between } = this.head, { frame } = this;
      const passed = Math.min(now - (this.last ?? now), HICCUP) / 1000;
      this.last = now;
      this.simulated += passed * Number(this.part('slow').value);
      const [begin, end] = this.range;
      if (this.simulated >= times[end] + (between ? 0 : interval)) this.simulated = times[begin];
      this.reach(this.simulated);
      if (between || frame !== this.frame) this.refresh();
    }

    // ---- what is seen

    /** A promise, because wear is unpacked when it is first chosen. */
    async colourBy(name) {
      const { values, wear } = this.head, value = [...values, ...(wear?.values ?? [])].find((one) => one.name === name);
      this.by = value; // undefined: a linked player of a file without wear
      this.link?.all(this, (one) => one.colourBy(name));
      if (value) {
        this.part('colour').value = name;
        this.part('bar').setAttribute('aria-label', value.describe);
        this.part('title').textContent = value.label;
        this.part('ticks').replaceChildren(...value.ticks.map(([share, text]) => {
          const tick = document.createElement('span');
          tick.textContent = text;
          tick.style.left = `${100 * share}%`;
          return tick;
        }));
      }
      if (value?.low) await this.view.wear(this.part('worn').textContent).catch((fault) => this.say(`The wear cannot be shown: ${fault.message}.`));
      this.refresh();
    }

    look(name) {
      this.link?.all(this, (one) => one.look(name));
      this.view.look(name);
      this.link?.level();
      this.draw();
    }

    reset() {
      this.show(this.head.first);
      this.look(FIRST_VIEW);
    }

    positions() { return this.view.positions(); }

    levels() { return this.view.level.slice(); }

    flashes() { return this.view.sparks.count; }

    pose(name) { return this.view.shownPose(this.head.motions.indexOf(name)); }

    ride(riding) {
      this.link?.all(this, (one) => one.ride(riding));
      this.view.ride(riding);
      this.link?.level();
      this.refresh();
    }
  }

  /** One clock, one camera and one set of controls for several players; `frame` is the element around them. */
  class Link {
    constructor(frame, players) {
      this.frame = frame;
      this.players = players;
      for (const one of players) one.link = this;
      const turning = players.map((one) => one.head.turns);
      const from = (values, k) => values.map((value) => value - k);
      this.scales = turning.every(Boolean)
        ? players.map((one, k) => from(turning[k], Math.floor(turning[k][one.head.first] + 1e-6)))
        : [];
      this.turns = this.scales.length > 0 && this.common()[0] < this.common()[1];
      if (!this.turns) this.scales = players.map(({ head }) => from(head.times, head.times[head.first]));
      const [begin, end] = this.common(), [scale] = this.scales, [{ part }] = players, slider = part('slider');
      const start = Math.max(0, scale.findIndex((value) => value >= begin - 1e-6));
      this.range = [start, Math.max(start, scale.findLastIndex((value) => value <= end + 1e-6))];
      [slider.min, slider.max] = this.range;
      const box = players.map((one) => one.flashBox).find(Boolean); // the first one may have none
      players.forEach((one, k) => Object.assign(one, { flashBox: box, pace: this.#speed(0) / this.#speed(k) }));
      if (box) part('scale').before(box.parentElement);
      frame.querySelector('.mp-shared').append(part('controls'));
    }

    /** How far the clock goes in a second of a player's time: what turns has a constant speed. */
    #speed(k) {
      const { times } = this.players[k].head, scale = this.scales[k], last = times.length - 1;
      return last ? (scale[last] - scale[0]) / (times[last] - times[0]) : 1;
    }

    /** The part of the clock that all players have frames for. */
    common() {
      const ends = this.scales.map((scale, k) => [scale[this.players[k].head.first], scale[scale.length - 1]]);
      return [Math.max(...ends.map(([begin]) => begin)), Math.min(...ends.map(([, end]) => end))];
    }

    /** The clock at the time that the first player shows. */
    reading() {
      const [{ head, clock }] = this.players;
      return this.scales[0][0] + (clock - head.times[0]) * this.#speed(0);
    }

    /** The others show the state at the clock of the first player. */
    follow(player) {
      if (player !== this.players[0]) return;
      const reading = this.reading();
      this.players.forEach((one, k) => {
        if (!k) return;
        one.reach(one.head.times[0] + (reading - this.scales[k][0]) / this.#speed(k));
        if (one.view) one.refresh();
      });
    }

    words() {
      const degrees = Math.round(360 * this.reading()) % 360;
      const times = this.players.map((one) => one.label().replace('t = ', '')).join(' | ');
      return this.turns ? `${degrees < 0 ? degrees + 360 : degrees}° (${times})` : times;
    }

    all(player, act) {
      if (this.busy) return;
      this.busy = true;
      for (const one of this.players) if (one !== player && one.view) act(one);
      this.busy = false;
    }

    /** The cameras of the others go where that of a player is. */
    aim(player) {
      this.all(player, (one) => {
        one.view.moved = player.view.moved;
        one.view.moveTo(player.view.stand());
        one.draw();
      });
    }

    /** After a named view: the camera that is farthest away, from which the largest mill fits, is that of all. */
    level() {
      const away = (one) => { const [eye, target] = one.view.stand(); return eye.distanceTo(target); };
      const there = this.players.filter((one) => one.view);
      if (there.length) this.aim(there.reduce((far, one) => (away(one) > away(far) ? one : far)));
    }

    joined(player) {
      if (player === this.players[0]) player.show(this.range[0]);
      else if (this.players[0].view) this.players[0].refresh();
      this.level();
    }
  }

  const begin = () => {
    window.millPlayers = [...document.querySelectorAll('figure.mill-player')].map((f) => new Player(f));
    for (const frame of document.querySelectorAll('.mp-linked')) {
      const players = window.millPlayers.filter((one) => one.head && frame.contains(one.figure));
      if (players.length > 1) new Link(frame, players);
    }
  };
  if (document.readyState === 'loading') document.addEventListener('DOMContentLoaded', begin);
  else begin();
})();
