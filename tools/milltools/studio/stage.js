/* The picture of the mill: Mill3D.View, or without a graphics card MillPainter.Painter. */
'use strict';

const MillStage = (() => {
  const TURN = Math.PI / 36; // by a key
  const QUICK = 40; // [ms] after a picture that takes longer the page gets time for other things
  const SLOW = 250; // [ms] of a picture that is drawn with half the pixels each way from then on
  const LONGEST = 600; // [ms] the page waits so long at most
  const MEMORY = 48e6; // [bytes] of states to step back to
  const NO_WEBGL = 'This browser does not offer WebGL 2 here: the processor draws the mill, with fewer pictures a second.';
  const SCALE = [1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10];

  const rounded = (value) => {
    if (!(value > 0)) return 1;
    const power = 10 ** Math.floor(Math.log10(value));
    return SCALE.map((m) => m * power).find((end) => end >= value * (1 - 1e-9));
  };

  /** Whether this browser has WebGL 2, and whether a graphics card does its work. */
  function graphics() {
    const context = document.createElement('canvas').getContext('webgl2');
    if (!context) return { there: false, quick: false };
    const name = context.getParameter(context.getExtension('WEBGL_debug_renderer_info')?.UNMASKED_RENDERER_WEBGL ?? context.RENDERER);
    context.getExtension('WEBGL_lose_context')?.loseContext();
    return { there: true, quick: !/swiftshader|llvmpipe|software|basic render/i.test(name) };
  }

  /** The stage of a page: `parts` {canvas, box, lacking, say}. */
  class Stage {
    canvas; box; lacking; say; // as the constructor says
    onshow; onscale; // what is told of: the state that is shown, the end of the colours
    past = []; back = 0; draws = 0;
    graphics; view;

    constructor(parts) {
      Object.assign(this, parts);
      new ResizeObserver(() => this.resize()).observe(this.box);
      addEventListener('resize', () => this.resize());
      matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.ink());
      document.addEventListener('themechange', () => this.ink());
      // the wheel scrolls the page until the picture is clicked
      this.box.addEventListener('wheel', (e) => { if (document.activeElement !== this.canvas && !e.ctrlKey) e.stopPropagation(); }, { capture: true, passive: true });
      this.box.addEventListener('pointerdown', () => this.canvas.focus({ preventScroll: true }));
    }

    /** A new mill. The camera stays if the mill has the same motions and views as the one before. */
    mill(head) {
      const before = this.view, same = before && JSON.stringify([before.head.views, before.head.motions]) === JSON.stringify([head.views, head.motions]);
      const canvas = this.canvas.cloneNode(false), focused = document.activeElement === this.canvas;
      this.graphics ??= graphics();
      const context = this.graphics.quick ? canvas.getContext('webgl2', { alpha: true, antialias: true }) : null;
      this.lacking.textContent = this.graphics.there ? '' : NO_WEBGL;
      this.lacking.hidden = this.graphics.there;
      this.view = context ? new Mill3D.View(canvas, context, head) : new MillPainter.Painter(canvas, head);
      const { view } = this;
      view.name = same ? before.name : 'front';
      if (same) view.ride(before.riding, before.on);
      else view.ride(this.wanders(head), head.carrier);
      this.canvas.replaceWith(canvas);
      this.canvas = canvas;
      if (focused) canvas.focus({ preventScroll: true });
      view.controls.addEventListener('change', () => this.draw());
      if (!view.flat) {
        canvas.addEventListener('webglcontextlost', () => {
          if (canvas !== this.canvas) return; // that of a mill before
          this.lost = true;
          this.say('The graphics driver has stopped the picture. It returns by itself, or when you reload the page.');
        });
        canvas.addEventListener('webglcontextrestored', () => { this.lost = false; this.say(''); this.draw(); });
      }
      const stood = same && before.moved && before.stand();
      this.ink();
      this.resize();
      if (stood) { view.moved = true; view.moveTo(stood); }
      before?.controls.dispose();
      if (before && !before.flat) {
        before.renderer.dispose();
        before.renderer.forceContextLoss();
      }
      this.drawn = undefined;
      this.lost = false;
      Object.assign(this, { past: [], back: 0, limit: same ? this.limit : undefined });
      this.kept = Math.max(2, Math.min(200, Math.floor(MEMORY / (16 * head.drawn))));
    }

    /** Whether the path of the container is long compared with its size: then the camera rides first. */
    wanders(head) {
      const size = (hull) => Math.hypot(...[0, 1, 2].map((j) => {
        let low = Infinity, high = -Infinity;
        for (let k = j; k < hull.length; k += 3) [low, high] = [Math.min(low, hull[k]), Math.max(high, hull[k])];
        return high - low;
      }));
      return head.carrier >= 0 && size(head.hulls[0]) > 1.5 * size(head.hulls[1]);
    }

    /** A new state; shown at the browser's next picture. */
    state(state) {
      const { positions, speeds, poses, time } = state;
      if (this.past.length >= this.kept) this.past.shift();
      this.past.push({ positions, speeds, poses, time });
      this.back = 0;
      this.draw();
    }

    /** Steps back (1) or forward (-1) among the states kept; false if there is none. */
    step(by) {
      const back = this.back + by;
      if (back < 0 || back >= this.past.length) return false;
      this.back = back;
      this.draw();
      return true;
    }

    get shown() { return this.past[this.past.length - 1 - this.back]; }

    /** Draws at the browser's next picture, but not before the graphics have drawn the last one: where they are slow, the
        page stays quick. */
    draw() {
      if (this.asked || !this.view) return;
      if (this.drawing) { this.again = true; return; }
      this.asked = true;
      requestAnimationFrame(() => {
        this.asked = false;
        const { shown, view } = this;
        if (!shown || this.lost) return;
        if (shown !== this.drawn) {
          const { positions, speeds, poses } = shown;
          this.#measure(speeds);
          this.levels = this.levels?.length === speeds.length ? this.levels : new Uint8Array(speeds.length);
          for (let k = 0; k < speeds.length; k++) this.levels[k] = Math.min(255, (256 * speeds[k]) / this.limit);
          view.show(positions, this.levels, poses);
          this.drawn = shown;
          this.onshow?.(shown);
        }
        const begin = performance.now();
        view.draw();
        this.draws += 1;
        this.#wait(view, begin);
      });
    }

    #wait(view, begin) {
      if (view.flat && performance.now() - begin < QUICK) return; // it is drawn
      const gl = view.flat ? null : view.renderer.getContext(), done = gl?.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
      gl?.flush();
      this.drawing = true;
      const look = () => {
        if (done && view === this.view && !gl.isContextLost() && gl.getSyncParameter(done, gl.SYNC_STATUS) !== gl.SIGNALED) return setTimeout(look, 4);
        if (done) gl.deleteSync(done);
        const took = performance.now() - begin;
        if (took > SLOW && this.draws > 2 && !this.rough) { // without a graphics card: fewer pixels
          this.rough = true;
          this.resize();
        }
        return setTimeout(() => {
          this.drawing = false;
          if (this.again) { this.again = false; this.draw(); }
        }, took > QUICK ? Math.min(1.5 * took, LONGEST) : 0);
      };
      look();
    }

    /** The end of the colours: above the speeds of 99 % of the balls; changed only if it is far from that. */
    #measure(speeds) {
      const now = performance.now();
      if (this.limit && now - this.measured < 500) return;
      this.measured = now;
      const fast = Float32Array.from(speeds).sort()[Math.floor(0.99 * (speeds.length - 1))];
      if (this.limit && fast < 1.3 * this.limit && fast > 0.25 * this.limit) return;
      if (this.limit && fast < 1e-3) return;
      this.limit = rounded(Math.max(1.1 * fast, 0.01));
      this.onscale?.(this.limit);
    }

    ink() {
      if (!this.view) return;
      const [r, g, b] = getComputedStyle(this.box).color.match(/[\d.]+/g).map(Number);
      this.view.ink(0.3 * r + 0.6 * g + 0.1 * b > 128);
      this.draw();
    }

    resize() {
      const { clientWidth, clientHeight } = this.box;
      if (!this.view || !clientWidth || !clientHeight) return;
      this.view.resize(clientWidth, clientHeight, (devicePixelRatio || 1) * (this.rough ? 0.5 : 1));
      this.draw();
    }

    ride(riding, on) {
      this.view.ride(riding, on);
      this.drawn = undefined;
      this.draw();
    }

    look(name) {
      this.view?.look(name);
      this.draw();
    }

    /** What a key does to the view; false: nothing. */
    key(name) {
      const { view } = this;
      const act = view && {
        ArrowLeft: () => view.turn(TURN, 0), ArrowRight: () => view.turn(-TURN, 0), ArrowUp: () => view.turn(0, TURN), ArrowDown: () => view.turn(0, -TURN),
        '+': () => view.zoom(1.1), '=': () => view.zoom(1.1), '-': () => view.zoom(1 / 1.1), Home: () => view.look('front'),
      }[name];
      if (!act) return false;
      act();
      this.draw();
      return true;
    }
  }

  return { Stage, rounded };
})();
