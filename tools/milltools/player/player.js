/* The 3D player of the report: starts every <figure class="mill-player"> of the page and handles its buttons and keys.

   For scripts and tests, window.millPlayers[k] is the k-th player of the page:
     ready           promise: true when the player is drawn, false if the still picture is shown instead
     frames, frame   number of frames, index of the frame shown
     show(k)         pauses and shows frame k            play(), pause(), playing
     at(t)           pauses and shows the time t [s]     clock  the time shown [s]
     colourBy(name)  "speed", "spin", "energy"           look(name)  "front", "three-quarter", "end"
     positions()     centres of the balls as drawn, Float32Array (n, 3) [m]
     levels()        values for their colours, Uint8Array (n,): 255 is the end of the scale
     flashes()       number of flashes of impacts as drawn
     pose(name)      pose of a motion as drawn, three rows of four: a point p is at rotation p + centre
     ride(riding)    sets whether the camera moves with the container
     draws           pictures drawn so far */
'use strict';

(() => {
  const TURN = Math.PI / 36; // by a key
  const FIRST_VIEW = 'front';
  const QUICK = 40; // [ms] the player starts by itself if a picture takes less
  const HICCUP = 300; // [ms] a longer time between two pictures counts as this
  const NO_WEBGL = 'The 3D picture needs WebGL 2, which this browser does not offer here.';
  const NO_UNPACKING = 'The 3D picture needs a browser from 2023 or later (DecompressionStream).';

  class Player {
    constructor(figure) {
      const part = (name) => figure.querySelector(`.mp-${name}`);
      Object.assign(this, { figure, part, frame: 0, playing: false, draws: 0, by: 0, visible: false });
      this.ready = new Promise((resolve) => { this.settle = resolve; });
      const head = part('head');
      if (!head) return this.settle(false); // nothing is stored: the page says so
      this.head = JSON.parse(head.textContent);
      this.frames = this.head.times.length;
      this.frame = this.head.first;
      this.clock = this.head.times[this.frame];
      this.watch();
    }

    /** Nothing is unpacked or drawn before the player is first seen, or while it is out of sight. */
    watch() {
      new IntersectionObserver((entries) => {
        this.visible = entries[entries.length - 1].isIntersecting;
        if (!this.visible) return;
        if (!this.started) this.start().catch((fault) => this.give_up(`The 3D picture failed: ${fault.message}.`));
        else if (this.view) { this.draw(); this.run(); }
      }, { rootMargin: '100px' }).observe(this.part('stage'));
    }

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
      if (still || this.frames < 2) return;
      await this.view.cost(); // the first one compiles
      if ((await this.view.cost()) < QUICK && !this.touched) this.play();
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
      if (part('flashes')) on(part('flashes'), 'change', () => this.refresh());
      on(part('colour'), 'change', () => this.colourBy(part('colour').value));
      const camera = part('camera');
      if (camera) on(camera, 'change', () => this.ride(camera.value === 'riding'));
      for (const button of this.figure.querySelectorAll('[data-view]')) {
        on(button, 'click', () => this.look(button.dataset.view));
      }
      on(part('reset'), 'click', () => this.reset());
      on(canvas, 'keydown', (e) => this.key(e));
      view.controls.addEventListener('change', () => this.draw());
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
      on(full, 'click', () => (document.fullscreenElement ? document.exitFullscreen() : this.figure.requestFullscreen()));
      new ResizeObserver(() => this.resize()).observe(part('stage'));
      addEventListener('resize', () => this.resize()); // the device's pixels may have changed
      matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.ink());
      document.addEventListener('themechange', () => this.ink()); // the report's own choice of light and dark
      addEventListener('beforeprint', () => this.picture());
      this.ink();
    }

    key(event) {
      if (event.ctrlKey || event.altKey || event.metaKey) return;
      const { view } = this;
      const act = {
        ArrowLeft: () => view.turn(TURN, 0),
        ArrowRight: () => view.turn(-TURN, 0),
        ArrowUp: () => view.turn(0, TURN),
        ArrowDown: () => view.turn(0, -TURN),
        '+': () => view.zoom(1.1),
        '=': () => view.zoom(1.1),
        '-': () => view.zoom(1 / 1.1),
        ' ': () => (this.playing ? this.pause() : this.play()),
        ',': () => this.show(Math.max(0, this.frame - 1)),
        '.': () => this.show(Math.min(this.frames - 1, this.frame + 1)),
        Home: () => this.reset(),
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
      const { head, part } = this, flashes = part('flashes')?.checked;
      this.view.place(this.frame, this.clock, this.by, flashes ? head.seen * Number(part('slow').value) : 0);
      const text = this.clock > head.times[this.frame] || this.playing && head.between
        ? `t = ${(1e3 * this.clock).toFixed(head.places + 1)} ms` : head.labels[this.frame];
      const slider = this.part('slider');
      slider.value = this.frame;
      slider.setAttribute('aria-valuetext', text);
      this.part('time').textContent = text;
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
      const { times, between } = this.head;
      this.frame = Math.max(0, times.findLastIndex((t) => t <= time + 1e-9));
      this.clock = between ? Math.min(Math.max(time, times[0]), times[times.length - 1]) : times[this.frame];
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
        this.looping = this.playing && this.visible && !this.lost;
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
      if (this.simulated >= times[times.length - 1] + (between ? 0 : interval)) this.simulated = times[0];
      this.reach(this.simulated);
      if (between || frame !== this.frame) this.refresh();
    }

    // ---- what is seen

    colourBy(name) {
      const { values } = this.head;
      this.by = Math.max(0, values.findIndex((v) => v.name === name));
      this.part('colour').value = values[this.by].name;
      const bar = this.part('bar');
      bar.setAttribute('aria-label', values[this.by].describe);
      this.part('title').textContent = values[this.by].label;
      const ticks = this.part('ticks');
      ticks.replaceChildren(...values[this.by].ticks.map(([share, text]) => {
        const tick = document.createElement('span');
        tick.textContent = text;
        tick.style.left = `${100 * share}%`;
        return tick;
      }));
      this.refresh();
    }

    look(name) {
      this.view.look(name);
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
      this.view.ride(riding);
      this.refresh();
    }
  }

  const begin = () => {
    window.millPlayers = [...document.querySelectorAll('figure.mill-player')].map((f) => new Player(f));
  };
  if (document.readyState === 'loading') document.addEventListener('DOMContentLoaded', begin);
  else begin();
})();
