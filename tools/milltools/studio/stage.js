/* The picture of the mill: Mill3D.View, or without WebGL 2 a drawing of the cross-section. */
'use strict';

const MillStage = (() => {
  const TURN = Math.PI / 36; // by a key
  const QUICK = 40; // [ms] after a picture that takes longer the page gets time for other things
  const SLOW = 250; // [ms] of a picture that is drawn with half the pixels each way from then on
  const LONGEST = 600; // [ms] the page waits so long at most
  const MEMORY = 48e6; // [bytes] of states to step back to
  const NO_WEBGL = 'The picture in 3D needs WebGL 2, which this browser does not offer here: the cross-section is drawn instead.';
  const SCALE = [1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10];

  const rounded = (value) => {
    if (!(value > 0)) return 1;
    const power = 10 ** Math.floor(Math.log10(value));
    return SCALE.map((m) => m * power).find((end) => end >= value * (1 - 1e-9));
  };

  /** The mill seen along the axis of its container, as a drawing: balls as circles, bodies as their shadows. */
  class Section {
    constructor(canvas, head) {
      Object.assign(this, { canvas, head, pen: canvas.getContext('2d'), flat: true });
      const unit = (a) => { const size = Math.hypot(...a); return a.map((x) => x / size); };
      const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
      const out = unit(head.views.end), straight = Math.abs(out.reduce((sum, x, k) => sum + x * head.up[k], 0)) > 0.99;
      this.right = unit(cross(straight ? [0, 1, 0] : head.up, out));
      this.up = cross(out, this.right);
      this.out = out;
      this.radius = head.runs.flatMap(([many, diameter]) => Array(many).fill(diameter / 2));
      this.on = head.carrier;
    }

    ride(riding, on = this.head.carrier) { Object.assign(this, { riding, on }); }

    ink(dark) { this.dark = dark; }

    look() {}

    turn() {}

    zoom() {}

    resize(width, height, ratio) {
      this.canvas.width = width * ratio;
      this.canvas.height = height * ratio;
    }

    show(positions, levels, poses) { Object.assign(this, { positions, levels, poses }); }

    /** Places in the laboratory as seen from the motion that the picture rides on. */
    #seen() {
      const { riding, on, head, poses } = this;
      if (!riding || on < 0) return (x, y, z) => [x, y, z];
      const now = poses.subarray(12 * on, 12 * on + 12), start = head.poses.subarray(12 * on, 12 * on + 12);
      return (x, y, z) => {
        const d = [x - now[3], y - now[7], z - now[11]], own = [0, 1, 2].map((k) => now[k] * d[0] + now[4 + k] * d[1] + now[8 + k] * d[2]);
        return [0, 1, 2].map((k) => start[4 * k] * own[0] + start[4 * k + 1] * own[1] + start[4 * k + 2] * own[2] + start[4 * k + 3]);
      };
    }

    draw() {
      const { canvas, head, pen, poses, positions, levels } = this, { right, up, out } = this;
      if (!positions || !canvas.width) return;
      const seen = this.#seen(), dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
      const hull = head.hulls[this.riding && this.on === head.carrier ? 1 : 0], flat = [];
      for (let k = 0; k < hull.length; k += 3) { const p = hull.subarray(k, k + 3); flat.push([dot(p, right), dot(p, up)]); }
      const ends = [0, 1].map((j) => [Math.min(...flat.map((p) => p[j])), Math.max(...flat.map((p) => p[j]))]);
      const scale = 0.92 * Math.min(canvas.width / (ends[0][1] - ends[0][0]), canvas.height / (ends[1][1] - ends[1][0]));
      const middle = ends.map(([low, high]) => (low + high) / 2);
      const place = (p) => [canvas.width / 2 + scale * (dot(p, right) - middle[0]), canvas.height / 2 - scale * (dot(p, up) - middle[1])];
      pen.clearRect(0, 0, canvas.width, canvas.height);
      const shadow = ({ points, corners, motion }) => { // of one sense of turning, so that all of it is filled
        const pose = motion >= 0 && poses.subarray(12 * motion, 12 * motion + 12), at = [], shape = new Path2D();
        for (let k = 0; k < points.length; k += 3) {
          const [x, y, z] = points.subarray(k, k + 3);
          at.push(place(pose ? seen(...[0, 4, 8].map((r) => pose[r] * x + pose[r + 1] * y + pose[r + 2] * z + pose[r + 3])) : seen(x, y, z)));
        }
        for (let k = 0; k < corners.length; k += 3) {
          let [a, b, c] = [at[corners[k]], at[corners[k + 1]], at[corners[k + 2]]];
          if ((b[0] - a[0]) * (c[1] - a[1]) < (c[0] - a[0]) * (b[1] - a[1])) [b, c] = [c, b];
          shape.moveTo(...a);
          shape.lineTo(...b);
          shape.lineTo(...c);
          shape.closePath();
        }
        return shape;
      };
      const paint = (look, fill, edge) => {
        for (const shape of head.bodies.filter((body) => body.look === look).map(shadow)) {
          if (edge) { pen.strokeStyle = edge; pen.lineWidth = canvas.width / 250; pen.lineJoin = 'round'; pen.stroke(shape); }
          pen.fillStyle = fill;
          pen.fill(shape);
        }
      };
      paint('shell', this.dark ? '#1e2530' : '#eef2f8', this.dark ? '#6f7d95' : '#8b97aa');
      const order = Array.from(this.radius, (_, k) => k).map((k) => {
        const p = seen(positions[3 * k], positions[3 * k + 1], positions[3 * k + 2]);
        return [dot(p, out), k, ...place(p)];
      }).sort((a, b) => a[0] - b[0]);
      const colours = this.colours ??= Array.from({ length: 256 }, (_, k) => `rgb(${head.colours.slice(3 * k, 3 * k + 3)})`);
      pen.lineWidth = Math.max(1, canvas.width / 1500);
      pen.strokeStyle = this.dark ? '#0008' : '#0004';
      for (const [, k, x, y] of order) {
        pen.beginPath();
        pen.arc(x, y, scale * this.radius[k], 0, 2 * Math.PI);
        pen.fillStyle = colours[levels[k]];
        pen.fill();
        pen.stroke();
      }
      paint('steel', this.dark ? '#9aa3b2cc' : '#6b7280cc');
    }
  }

  /** The stage of a page: `parts` {canvas, box, lacking, say}. */
  class Stage {
    constructor(parts) {
      Object.assign(this, { ...parts, past: [], back: 0, draws: 0 });
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
      const context = canvas.getContext('webgl2', { alpha: true, antialias: true });
      this.lacking.textContent = context ? '' : NO_WEBGL;
      this.lacking.hidden = Boolean(context);
      this.view = context ? new Mill3D.View(canvas, context, head) : new Section(canvas, head);
      const { view } = this;
      view.name = same ? before.name : 'front';
      if (same) view.ride(before.riding, before.on);
      else view.ride(this.wanders(head), head.carrier);
      this.canvas.replaceWith(canvas);
      this.canvas = canvas;
      if (focused) canvas.focus({ preventScroll: true });
      if (!view.flat) {
        view.controls.addEventListener('change', () => this.draw());
        canvas.addEventListener('webglcontextlost', () => {
          if (canvas !== this.canvas) return; // that of a mill before
          this.lost = true;
          this.say('The graphics driver has stopped the picture. It returns by itself, or when you reload the page.');
        });
        canvas.addEventListener('webglcontextrestored', () => { this.lost = false; this.say(''); this.draw(); });
      }
      const stood = same && before.moved && !view.flat && before.stand();
      this.ink();
      this.resize();
      if (stood) { view.moved = true; view.moveTo(stood); }
      if (before && !before.flat) { before.controls.dispose(); before.renderer.dispose(); before.renderer.forceContextLoss(); }
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
