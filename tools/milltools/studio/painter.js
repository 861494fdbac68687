/* The mill in 3D without WebGL, or where no graphics card helps it: the processor draws bodies and balls into an image.
   With 4000 balls some ten times as fast as WebGL in software. */
'use strict';

const MillPainter = (() => {
  const T = MillThree;
  const SHADES = 64; // of each colour
  const TABLE = 64; // pixels of the picture of a ball that all balls are drawn from

  /** sRGB byte of linear light 0..1, and the reverse. */
  const srgb = (light) => Math.round(255 * (light <= 0.0031308 ? 12.92 * light : 1.055 * Math.min(light, 1) ** (1 / 2.4) - 0.055));
  const linear = (byte) => (byte / 255 <= 0.04045 ? byte / 255 / 12.92 : ((byte / 255 + 0.055) / 1.055) ** 2.4);

  /** Light on a surface with this normal, as seen by the eye (x to the right, y up): that of Mill3D. */
  function light(x, y, z) {
    const sun = Math.max(0, -0.424 * x + 0.707 * y + 0.566 * z), gloss = Math.max(0, -0.24 * x + 0.4 * y + 0.885 * z);
    return 0.7 * sun + 0.477 * (0.65 + 0.35 * y) + 0.08 * sun * gloss ** 40;
  }

  const pixel = (bytes) => ((255 << 24) | (bytes[2] << 16) | (bytes[1] << 8) | bytes[0]) >>> 0;

  /** For each colour of 256 its shades, from no light to the most, as pixels. */
  function paints(colours) {
    const found = new Uint32Array(256 * SHADES);
    for (let k = 0; k < found.length; k++) {
      const from = 3 * Math.floor(k / SHADES), bright = (1.3 * (k % SHADES)) / (SHADES - 1);
      found[k] = pixel([0, 1, 2].map((j) => srgb(linear(colours[from + j]) * bright)));
    }
    return found;
  }

  /** The shade of each pixel of a ball. */
  const BALL = Uint8Array.from({ length: TABLE * TABLE }, (_, k) => {
    const [x, y] = [k % TABLE, Math.floor(k / TABLE)].map((i) => (i + 0.5) / (TABLE / 2) - 1), r = Math.hypot(x, y);
    const shade = r < 1 ? light(x, -y, Math.sqrt(1 - r * r)) : light(x / r, -y / r, 0);
    return Math.min(SHADES - 1, Math.round((shade / 1.3) * (SHADES - 1)));
  });

  class Painter extends Mill3D.Eye {
    flat = true;
    positions; levels; // of the state that is shown

    constructor(canvas, head) {
      super(canvas, head);
      this.pen = canvas.getContext('2d', { willReadFrequently: true }); // drawn by the processor
      this.image = document.createElement('canvas');
      this.parts = head.bodies.map(({ look, motion, points, corners }) => ({ look, motion,
        triangles: Float32Array.from({ length: 3 * corners.length }, (_, k) => points[3 * corners[Math.floor(k / 3)] + (k % 3)]) }));
      this.radius = Float32Array.from(head.runs.flatMap(([many, diameter]) => Array(many).fill(diameter / 2)));
      this.paints = paints(head.colours);
    }

    ink(dark) {
      this.colours = dark ? { steel: [154, 163, 178], shell: 'rgb(184 200 230 / 0.07)', rim: '#6f7d95' }
        : { steel: [107, 114, 128], shell: 'rgb(82 105 140 / 0.09)', rim: '#8b97aa' };
    }

    resize(width, height, ratio) {
      this.ratio = Math.min(ratio, 1.5); // what the processor can do
      for (const canvas of [this.canvas, this.image]) {
        canvas.width = Math.max(1, Math.round(width * this.ratio));
        canvas.height = Math.max(1, Math.round(height * this.ratio));
      }
      this.paper = this.image.getContext('2d', { willReadFrequently: true });
      this.data = this.paper.createImageData(this.image.width, this.image.height);
      this.pixels = new Uint32Array(this.data.data.buffer);
      this.near = new Float32Array(this.pixels.length); // 1 / distance [1/m] of the steel in each pixel
      super.resize(width, height);
    }

    show(positions, levels, poses) {
      Object.assign(this, { positions, levels, poses });
      this.move(0, 0);
    }

    /** From the frame of a motion (-1: the laboratory) to that of the eye. */
    #eye(motion) {
      const to = this.camera.matrixWorldInverse.clone().multiply(this.world.matrix);
      return motion < 0 ? to : to.multiply(this.moving[motion].matrix);
    }

    /** What the eye sees of points (n, 3): x and y in pixels, and the distance along the view [m]. */
    #seen(points, matrix) {
      const m = matrix.elements, { canvas, zoomed } = this, seen = new Float32Array(points.length);
      for (let k = 0; k < points.length; k += 3) {
        const x = points[k], y = points[k + 1], z = points[k + 2];
        const away = Math.max(-(m[2] * x + m[6] * y + m[10] * z + m[14]), 1e-6);
        seen[k] = canvas.width / 2 + (zoomed * (m[0] * x + m[4] * y + m[8] * z + m[12])) / away;
        seen[k + 1] = canvas.height / 2 - (zoomed * (m[1] * x + m[5] * y + m[9] * z + m[13])) / away;
        seen[k + 2] = away;
      }
      return seen;
    }

    draw() {
      const { canvas, pen, camera, head, positions } = this;
      if (!positions || !canvas.width) return;
      camera.updateMatrixWorld();
      this.zoomed = (canvas.height / 2) * camera.projectionMatrix.elements[5];
      this.pixels.fill(0);
      this.near.fill(0);
      const parts = this.parts.map((part) => ({ ...part, matrix: this.#eye(part.motion) }))
        .map((part) => ({ ...part, seen: this.#seen(part.triangles, part.matrix) }));
      for (const part of parts) if (part.look === 'steel') this.#steel(part);
      this.#balls(this.#seen(positions, this.#eye(-1)));
      this.paper.putImageData(this.data, 0, 0);
      pen.clearRect(0, 0, canvas.width, canvas.height);
      this.#shell(parts);
      pen.drawImage(this.image, 0, 0);
      this.#shell(parts);
      const lines = this.#seen(head.edges.lines, this.#eye(head.carrier));
      pen.beginPath();
      for (let k = 0; k < lines.length; k += 6) { pen.moveTo(lines[k], lines[k + 1]); pen.lineTo(lines[k + 3], lines[k + 4]); }
      pen.strokeStyle = this.colours.rim;
      pen.lineWidth = 1.2 * this.ratio;
      pen.stroke();
    }

    /** The container as a veil: once behind the balls, once before them. */
    #shell(parts) {
      const { pen } = this;
      pen.fillStyle = this.colours.shell;
      for (const { look, seen } of parts) {
        if (look !== 'shell') continue;
        pen.beginPath();
        for (let k = 0; k < seen.length; k += 9) { // of one sense of turning, so that all of it is filled once
          const turned = (seen[k + 3] - seen[k]) * (seen[k + 7] - seen[k + 1]) < (seen[k + 6] - seen[k]) * (seen[k + 4] - seen[k + 1]);
          const [b, c] = turned ? [6, 3] : [3, 6];
          pen.moveTo(seen[k], seen[k + 1]);
          pen.lineTo(seen[k + b], seen[k + b + 1]);
          pen.lineTo(seen[k + c], seen[k + c + 1]);
        }
        pen.fill();
      }
    }

    /** Triangles in one colour each; the nearest is seen. 1 / distance is linear on the picture. */
    #steel({ triangles, matrix, seen }) {
      const { pixels, near } = this, { width, height } = this.image, m = matrix.elements;
      const edge = [new T.Vector3(), new T.Vector3()], normal = new T.Vector3();
      for (let k = 0; k < seen.length; k += 9) {
        const [ax, ay, bx, by, cx, cy] = [seen[k], seen[k + 1], seen[k + 3], seen[k + 4], seen[k + 6], seen[k + 7]];
        const area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay);
        if (!area) continue;
        edge.forEach((e, j) => e.set(...[0, 1, 2].map((i) => triangles[k + 3 + 3 * j + i] - triangles[k + i])));
        normal.crossVectors(...edge).normalize();
        const [x, y, z] = [0, 1, 2].map((j) => m[j] * normal.x + m[4 + j] * normal.y + m[8 + j] * normal.z), side = z < 0 ? -1 : 1;
        const bright = light(side * x, side * y, side * z), paint = pixel(this.colours.steel.map((byte) => srgb(linear(byte) * bright)));
        const [ia, ib, ic] = [1 / seen[k + 2], 1 / seen[k + 5], 1 / seen[k + 8]];
        const top = Math.max(0, Math.ceil(Math.min(ay, by, cy) - 0.5)), bottom = Math.min(height - 1, Math.floor(Math.max(ay, by, cy) - 0.5));
        const left = Math.max(0, Math.ceil(Math.min(ax, bx, cx) - 0.5)), right = Math.min(width - 1, Math.floor(Math.max(ax, bx, cx) - 0.5));
        for (let row = top; row <= bottom; row++) {
          for (let column = left; column <= right; column++) {
            const px = column + 0.5, py = row + 0.5;
            const u = ((px - ax) * (cy - ay) - (cx - ax) * (py - ay)) / area, v = ((bx - ax) * (py - ay) - (px - ax) * (by - ay)) / area;
            if (u < -1e-6 || v < -1e-6 || u + v > 1 + 1e-6) continue;
            const here = ia + u * (ib - ia) + v * (ic - ia), at = row * width + column;
            if (here <= near[at]) continue;
            near[at] = here;
            pixels[at] = paint;
          }
        }
      }
    }

    /** Balls, the farthest first, where they are in front of the steel. */
    #balls(seen) {
      const { pixels, near, radius, levels, zoomed, count, paints: shades } = this, { width, height } = this.image;
      const many = 2 ** Math.ceil(Math.log2(count + 1)), order = new Float64Array(count); // distance, then number
      for (let k = 0; k < count; k++) order[k] = -Math.round(seen[3 * k + 2] * 1e6) * many + k;
      order.sort();
      for (const key of order) {
        const k = key - Math.floor(key / many) * many, x = seen[3 * k], y = seen[3 * k + 1], r = (radius[k] * zoomed) / seen[3 * k + 2];
        const limit = 1 / (seen[3 * k + 2] - radius[k]), base = SHADES * levels[k], step = TABLE / (2 * r), r2 = r * r;
        const top = Math.max(0, Math.ceil(y - r - 0.5)), bottom = Math.min(height - 1, Math.floor(y + r - 0.5));
        for (let row = top; row <= bottom; row++) {
          const dy = row + 0.5 - y, half = Math.sqrt(Math.max(0, r2 - dy * dy)), line = TABLE * Math.min(TABLE - 1, Math.floor((dy + r) * step));
          const left = Math.max(0, Math.ceil(x - half - 0.5)), right = Math.min(width - 1, Math.floor(x + half - 0.5));
          for (let column = left, at = row * width + left; column <= right; column++, at++) {
            if (near[at] < limit) pixels[at] = shades[base + BALL[line + Math.min(TABLE - 1, ((column + 0.5 - x + r) * step) | 0)]];
          }
        }
      }
    }
  }

  return { Painter };
})();
