/* The mill in WebGL: draws the data of frames.py, or a mill that is simulated now (studio/), with three.js (vendor/).
   player.js and studio.js handle the pages and their buttons. Lengths in m, angles in rad, in the frame of the simulation (x along the drum). */
'use strict';

const Mill3D = (() => {
  const T = MillThree;
  const FIELD = 26; // [degrees] of view, up and down
  const MOST_FLASHES = 500; // at a time
  const NEAR = [0.06, 0.5]; // opacity of the near side of a worn container, where it is worn least and most
  const FAINT = 0.15; // opacity of balls in a worn mill
  const FRONT = 0, BACK = 1; // sides of triangles, as three.js numbers them
  const UNTOUCHED = 0.3; // linear grey of surfaces without impacts

  /** Bytes of base64 text. */
  function bytesOf(text) {
    const raw = atob(text.trim());
    const bytes = new Uint8Array(raw.length);
    for (let k = 0; k < raw.length; k++) bytes[k] = raw.charCodeAt(k);
    return bytes;
  }

  /** Square of a number with its sign: velocities are stored as such roots. */
  const square = (q) => q * Math.abs(q);

  /** Promise of the bytes in a gzip stream, as base64 text. */
  async function gunzip(text) {
    const stream = new Blob([bytesOf(text)]).stream().pipeThrough(new DecompressionStream('gzip'));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  /** Promise of {position: Uint16Array (F, n, 3), velocity: Int8Array (F, n, 3), spin: Uint8Array (F, n)}; frames.py has
      the format. */
  async function unpack(text, { times, drawn, forecast }) {
    const bytes = await gunzip(text);
    const frames = times.length, row = 10 * drawn;
    if (bytes.length !== frames * row) throw new Error('the data are not complete');
    const position = new Uint16Array(frames * drawn * 3), velocity = new Int8Array(frames * drawn * 3);
    const spin = new Uint8Array(frames * drawn);
    for (let f = 0; f < frames; f++) {
      for (let axis = 0; axis < 3; axis++) {
        const quick = f * row + axis * drawn, high = f * row + (4 + 2 * axis) * drawn, low = high + drawn;
        for (let k = 0; k < drawn; k++) {
          const at = (f * drawn + k) * 3 + axis, before = at - 3 * drawn;
          velocity[at] = bytes[quick + k];
          const zigzag = (bytes[high + k] << 8) | bytes[low + k];
          const guess = f ? position[before]
            + Math.floor(forecast[axis] * (square(velocity[before]) + square(velocity[at])) + 0.5) : 0;
          position[at] = guess + ((zigzag >> 1) ^ -(zigzag & 1)); // wraps at 16 bits
        }
      }
      spin.set(bytes.subarray(f * row + 3 * drawn, f * row + 4 * drawn), f * drawn);
    }
    return { position, velocity, spin };
  }

  /** sRGB bytes as linear light, which three.js uses. */
  function linear(bytes) {
    return Float32Array.from(bytes, (b) => {
      const c = b / 255;
      return c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
    });
  }

  function surface(points, triangles) {
    const geometry = new T.BufferGeometry();
    geometry.setAttribute('position', new T.BufferAttribute(Float32Array.from(points), 3));
    geometry.setIndex(triangles);
    geometry.computeVertexNormals();
    return geometry;
  }

  // A ball is a square that faces the eye. For each pixel the ray from the eye meets the sphere, so that balls are round
  // at any size, and hide each other where their surfaces do. The light is that of the bodies.
  const BALL = {
    uniforms: () => ({ up: { value: new T.Vector3() }, opacity: { value: 1 } }),
    vertexShader: `
      attribute vec3 place; // centre, in the frame of the world
      attribute vec3 tint; // linear
      attribute float size; // radius
      varying vec3 centre, toward, colour;
      varying float radius;
      void main() {
        centre = (modelViewMatrix * vec4(place, 1.0)).xyz;
        radius = size;
        colour = tint;
        float away = length(centre), edge = size * away / sqrt(max(away * away - size * size, 1e-12)); // of its outline
        vec3 forward = centre / away, right = normalize(cross(forward, vec3(0.0, 1.0, 1e-4)));
        toward = centre + 1.01 * edge * (position.x * right + position.y * cross(right, forward));
        gl_Position = projectionMatrix * vec4(toward, 1.0);
      }`,
    fragmentShader: `
      uniform mat4 projectionMatrix;
      uniform vec3 up;
      uniform float opacity;
      varying vec3 centre, toward, colour;
      varying float radius;
      void main() {
        vec3 ray = normalize(toward);
        float along = dot(ray, centre), within = along * along - dot(centre, centre) + radius * radius;
        if (within < 0.0) discard;
        vec3 hit = (along - sqrt(within)) * ray, normal = (hit - centre) / radius;
        vec4 seen = projectionMatrix * vec4(hit, 1.0);
        gl_FragDepth = 0.5 * seen.z / seen.w + 0.5;
        vec3 sun = normalize(vec3(-0.6, 1.0, 0.8)), half_way = normalize(sun - ray);
        float lit = max(dot(normal, sun), 0.0), sky = 0.5 + 0.5 * dot(normal, normalize((viewMatrix * vec4(up, 0.0)).xyz));
        vec3 light = vec3(0.7 * lit) + 0.477 * mix(vec3(0.246, 0.279, 0.353), vec3(1.0), sky);
        gl_FragColor = vec4(colour * light + 0.06 * lit * pow(max(dot(normal, half_way), 0.0), 40.0), opacity);
        #include <colorspace_fragment>
      }`,
  };

  /** Float32Array of base64 text; or already such an array. */
  const floats = (text) => (typeof text === 'string' ? new Float32Array(bytesOf(text).buffer) : text);

  /** Vectors of base64 text. */
  function vectors(text) {
    const values = floats(text);
    return Array.from({ length: values.length / 3 }, (_, k) => new T.Vector3().fromArray(values, 3 * k));
  }

  /** Six-sided bars along lines. */
  function bars({ lines, width }, material) {
    const ends = vectors(lines), one = new T.Group(), up = new T.Vector3(0, 1, 0);
    const mesh = new T.InstancedMesh(new T.CylinderGeometry(width, width, 1, 6), material, ends.length / 2);
    for (let k = 0; k < ends.length; k += 2) {
      const along = ends[k + 1].clone().sub(ends[k]);
      one.position.copy(ends[k]).add(ends[k + 1]).multiplyScalar(0.5);
      one.scale.set(1, along.length() + 0.6 * width, 1);
      one.quaternion.setFromUnitVectors(up, along.normalize());
      one.updateMatrix();
      mesh.setMatrixAt(k / 2, one.matrix);
    }
    mesh.frustumCulled = false;
    return mesh;
  }

  /** A body of points (N, 3) and corners of its triangles, smooth but for edges sharper than about 35 degrees. `values`:
      arrays by triangle; `means` of the geometry have of each its mean around every corner, within sharp edges. */
  function solid(points, corners, values = []) {
    const face = [], size = [], around = []; // normals and areas of the triangles; at which triangles a point is
    for (let k = 0; k < corners.length; k += 3) {
      const [a, b, c] = [0, 1, 2].map((j) => new T.Vector3().fromArray(points, 3 * corners[k + j]));
      face.push(b.sub(a).cross(c.sub(a))); // its length is twice the area, so large triangles have more weight
      size.push(face[k / 3].length());
      for (let j = k; j < k + 3; j++) (around[corners[j]] ??= []).push(k / 3);
    }
    const place = new Float32Array(3 * corners.length), normal = new Float32Array(3 * corners.length);
    const means = values.map(() => new Float32Array(corners.length));
    corners.forEach((point, k) => {
      const triangle = Math.floor(k / 3), own = face[triangle], sum = new T.Vector3();
      const smooth = around[point].filter((other) => face[other].dot(own) >= 0.82 * size[other] * size[triangle]);
      const whole = smooth.reduce((area, other) => area + size[other], 0);
      for (const other of smooth) {
        sum.add(face[other]);
        values.forEach((value, c) => { means[c][k] += (value[other] * size[other]) / whole; });
      }
      place.set(points.subarray(3 * point, 3 * point + 3), 3 * k);
      sum.normalize().toArray(normal, 3 * k);
    });
    const geometry = new T.BufferGeometry();
    geometry.setAttribute('position', new T.BufferAttribute(place, 3));
    geometry.setAttribute('normal', new T.BufferAttribute(normal, 3));
    return Object.assign(geometry, { means });
  }

  /** A body from player.py. */
  const plain = ({ points, corners, wide }) => solid(floats(points),
    typeof corners === 'string' ? new (wide ? Uint32Array : Uint16Array)(bytesOf(corners).buffer) : corners);

  /** The bodies of worn.py with `means` of all quantities, from their bytes. */
  function worn(bytes, { bodies, facets, values: quantities }) {
    let at = 0;
    const take = (kind, count) => new kind(bytes.buffer.slice(at, at += count * kind.BYTES_PER_ELEMENT));
    const summed = (steps) => { for (let k = 1; k < steps.length; k++) steps[k] += steps[k - 1]; return steps; };
    const found = bodies.map((body) => ({
      ...body,
      corners: summed(take(Int32Array, 3 * body.triangles)),
      facet: summed(take(Int32Array, body.triangles)),
      planes: take(Uint16Array, 3 * body.points),
    }));
    const values = quantities.map(({ low, limit }) => Float64Array.from(take(Uint8Array, facets),
      (level) => level && low * (limit / low) ** ((level - 1) / 254)));
    if (at !== bytes.length) throw new Error('the wear is not complete');
    return found.map(({ shell, motion, lower, step, points, corners, facet, planes }) => {
      const place = Float32Array.from({ length: 3 * points }, (_, k) => lower[k % 3] + step * planes[points * (k % 3) + Math.floor(k / 3)]);
      return { shell, motion, geometry: solid(place, corners, values.map((value) => Float64Array.from(facet, (f) => value[f]))) };
    });
  }

  /** A disc of radius 1 that faces +z: opaque in the middle, transparent at its edge. */
  function disc() {
    const points = [], colours = [], triangles = [], around = 20;
    for (const [radius, white, opacity] of [[0, 1, 1], [0.4, 0.35, 0.9], [1, 0, 0]]) {
      for (let k = 0; k < around; k++) {
        const angle = (2 * Math.PI * k) / around, at = points.length / 3, next = at - k + ((k + 1) % around);
        points.push(radius * Math.cos(angle), radius * Math.sin(angle), 0);
        colours.push(white, white, white, opacity);
        if (radius) triangles.push(at - around, at, next, at - around, next, next - around);
      }
    }
    const geometry = surface(points, triangles);
    geometry.setAttribute('color', new T.BufferAttribute(Float32Array.from(colours), 4));
    return geometry;
  }

  /** Weights of both values and both slopes of the cubic at a share of its way. */
  function hermite(u) {
    const v = 1 - u;
    return [v * v * (1 + 2 * u), u * u * (3 - 2 * u), u * v * v, -u * u * v];
  }

  /** Camera and motions of a mill, however it is drawn. */
  class Eye {
    /** `head`: what player.py wrote, or what studio/source.js makes of a mill that is simulated now */
    constructor(canvas, head) {
      this.head = head;
      this.canvas = canvas;
      this.count = head.drawn;
      this.camera = new T.PerspectiveCamera(FIELD, 1, 0.01, 10);
      this.camera.up.fromArray(head.up);
      this.controls = new T.OrbitControls(this.camera, canvas);
      this.controls.enableDamping = false;
      canvas.style.touchAction = 'pan-y'; // a finger that moves up or down scrolls the page
      this.on = head.carrier; // number of the motion that the camera can be fixed to
      this.world = new T.Group(); // everything that turns when the camera moves with the container
      this.world.matrixAutoUpdate = false;
      this.twists = floats(head.twists ?? []);
      this.poses = floats(head.poses); // of all frames, or of the state that is shown
      this.start = this.poses.slice(0, 12 * head.motions.length);
      this.moving = head.motions.map(() => new T.Group());
      for (const group of this.moving) group.matrixAutoUpdate = false;
      this.world.add(...this.moving);
      this.moved = false;
      this.controls.addEventListener('start', () => { this.moved = true; });
    }

    /** The pose of a motion in a frame, three rows of four. */
    pose(frame, motion) {
      const from = 12 * (frame * this.moving.length + motion);
      return this.poses.subarray(from, from + 12);
    }

    /** The pose of a motion as drawn. */
    shownPose(motion) {
      const m = this.moving[motion].matrix.elements;
      return Float32Array.from({ length: 12 }, (_, k) => m[4 * (k % 4) + Math.floor(k / 4)]);
    }

    /** Sets whether the camera is fixed to a motion (else stated: the container's), whose parts then do not move, or to
        the laboratory. */
    ride(riding, on = this.head.carrier) {
      this.riding = riding;
      this.on = on;
      this.look(this.name);
    }

    /** Moves the bodies to a share 0..1 of the way from a frame to the next: turned evenly, on smooth paths. */
    move(frame, share) {
      const last = (this.head.times?.length ?? 1) - 1;
      const turn = new T.Group(), other = new T.Group(); // for their matrices
      this.moving.forEach((group, k) => {
        group.matrix.set(...this.pose(frame, k), 0, 0, 0, 1);
        if (share > 0) {
          const [before, here, next, after] = [-1, 0, 1, 2].map((d) => {
            other.matrix.set(...this.pose(Math.min(Math.max(frame + d, 0), last), k), 0, 0, 0, 1);
            return new T.Vector3().setFromMatrixPosition(other.matrix);
          });
          turn.quaternion.setFromRotationMatrix(group.matrix);
          other.matrix.set(...this.pose(frame + 1, k), 0, 0, 0, 1);
          turn.quaternion.slerp(other.quaternion.setFromRotationMatrix(other.matrix), share);
          const start = next.clone().sub(before).multiplyScalar(frame ? 0.5 : 1);
          const end = after.sub(here).multiplyScalar(frame + 1 < last ? 0.5 : 1);
          const [a, b, c, d] = hermite(share);
          here.multiplyScalar(a).addScaledVector(next, b).addScaledVector(start, c).addScaledVector(end, d);
          group.matrix.makeRotationFromQuaternion(turn.quaternion).setPosition(here);
        }
        group.matrixWorldNeedsUpdate = true;
      });
      this.world.matrix.identity();
      if (this.riding) {
        const now = this.moving[this.on].matrix.clone().invert();
        this.world.matrix.set(...this.start.subarray(12 * this.on, 12 * this.on + 12), 0, 0, 0, 1).multiply(now);
      }
      this.world.matrixWorldNeedsUpdate = true;
    }

    resize(width, height) {
      this.camera.aspect = width / height;
      this.camera.updateProjectionMatrix();
      if (!this.moved) this.look(this.name);
    }

    /** A named view of the space that the container sweeps, or of the container: "front", "three-quarter" or "end". */
    look(name) {
      const toward = new T.Vector3(...this.head.views[name]).normalize();
      const right = new T.Vector3(...this.head.up).cross(toward);
      if (right.length() < 1e-6) right.set(0, 1, 0); // from straight above
      right.normalize();
      const up = toward.clone().cross(right);
      const hull = vectors(this.head.hulls[this.riding && this.on === this.head.carrier ? 1 : 0]);
      const low = hull[0].clone(), high = hull[0].clone();
      for (const p of hull) { low.min(p); high.max(p); }
      const middle = low.add(high).multiplyScalar(0.5);
      const rise = Math.tan((FIELD * Math.PI) / 360), wide = rise * this.camera.aspect;
      let distance = 0;
      for (const p of hull) {
        p.sub(middle);
        const out = Math.max(Math.abs(p.dot(right)) / wide, Math.abs(p.dot(up)) / rise);
        distance = Math.max(distance, p.dot(toward) + 1.07 * out);
      }
      this.name = name;
      this.moved = false;
      this.camera.near = distance / 50;
      this.camera.far = distance * 20;
      this.camera.updateProjectionMatrix();
      this.controls.minDistance = 0.2 * distance;
      this.controls.maxDistance = 4 * distance;
      this.controls.target.copy(middle);
      this.camera.position.copy(toward.multiplyScalar(distance).add(middle));
      this.controls.update();
    }

    turn(left, up) {
      this.moved = true;
      this.controls.rotateLeft(left);
      this.controls.rotateUp(up);
    }

    /** Place and target of the eye, in the form for moveTo. */
    stand() {
      return [this.camera.position.clone(), this.controls.target.clone()];
    }

    /** @param {any[]} place */
    moveTo([eye, target]) {
      this.camera.position.copy(eye);
      this.controls.target.copy(target);
      this.controls.update();
    }

    zoom(factor) {
      this.moved = true;
      const { target } = this.controls;
      const away = this.camera.position.clone().sub(target);
      const { minDistance, maxDistance } = this.controls;
      away.setLength(Math.min(Math.max(away.length() / factor, minDistance), maxDistance));
      this.moveTo([away.add(target), target]);
    }
  }

  class View extends Eye {
    flat = false;
    coating; coated; coats; // promise of the worn bodies, the quantity that they show, the bodies
    places; tints; // of the balls

    /** `context`: a WebGL2 context of `canvas`; `frames`: what unpack() gave. Without frames show() draws states: `head`
        then has typed arrays in place of texts, and neither creases nor wear. */
    constructor(canvas, context, head, frames) {
      super(canvas, head);
      this.frames = frames;
      this.renderer = new T.WebGLRenderer({ canvas, context, antialias: true, alpha: true });
      this.renderer.setClearColor(0x000000, 0);
      this.scene = new T.Scene();
      this.colours = linear(typeof head.colours === 'string' ? bytesOf(head.colours) : head.colours);
      this.step = frames && head.upper.map((u, axis) => (u - head.lower[axis]) / 65535); // [m] of the positions
      this.radius = new Float64Array(this.count);
      this.mass = new Float64Array(this.count);
      this.level = new Uint8Array(this.count);
      this.flashes = floats(head.flashes ?? []);
      this.#furnish();
    }

    #furnish() {
      const { head, scene } = this;
      this.steel = new T.MeshPhongMaterial({ specular: 0x333333, shininess: 25, side: T.DoubleSide });
      this.shell = new T.MeshLambertMaterial({ transparent: true, depthWrite: false, side: T.DoubleSide });
      this.rim = new T.MeshLambertMaterial();
      this.worn = new T.MeshLambertMaterial({ vertexColors: true, side: T.DoubleSide });
      // of a worn container the far side, and its near side, through which the mill is seen
      this.inside = new T.MeshLambertMaterial({ vertexColors: true, side: FRONT });
      this.outside = new T.MeshLambertMaterial({ vertexColors: true, side: BACK, transparent: true, depthWrite: false });
      this.bare = []; // bodies in plain colours
      this.creases = []; // their edges, when they are worn: faces of one colour can be told apart
      const line = new T.MeshLambertMaterial({ color: 0x08090c });
      for (const body of head.bodies) {
        this.bare.push(this.#body(plain(body), body.motion, this[body.look], body.look === 'shell'));
        if (!body.creases) continue;
        this.creases.push(Object.assign(bars(body.creases, line), { visible: false }));
        (this.moving[body.motion] ?? this.world).add(this.creases.at(-1));
      }
      (this.moving[head.carrier] ?? this.world).add(bars(head.edges, this.rim));
      this.world.add(...this.#balls());
      const glow = new T.MeshLambertMaterial({ vertexColors: true, transparent: true, depthWrite: false, emissive: 0xd06010 });
      this.sparks = new T.InstancedMesh(disc(), glow, MOST_FLASHES);
      this.sparks.frustumCulled = false;
      this.sparks.renderOrder = 2;
      scene.add(this.world, this.sparks);
      const sun = new T.DirectionalLight(0xffffff, 2.2); // from over the viewer's left shoulder
      sun.position.set(-0.6, 1, 0.8);
      this.camera.add(sun, sun.target);
      const sky = new T.HemisphereLight(0xffffff, 0x8890a0, 1.5);
      sky.position.fromArray(head.up);
      scene.add(this.camera, sky);
    }

    #body(geometry, motion, material, late) {
      const mesh = new T.Mesh(geometry, material);
      mesh.renderOrder = late ? 1 : 0; // after the balls what is transparent
      (this.moving[motion] ?? this.world).add(mesh);
      return mesh;
    }

    /** Promise that the worn bodies are made, from the text of player.py. */
    wear(text) {
      this.coating ??= gunzip(text).then((bytes) => {
        this.coats = worn(bytes, this.head.wear).flatMap(({ shell, motion, geometry }) => {
          geometry.setAttribute('color', new T.BufferAttribute(new Float32Array(4 * geometry.means[0].length), 4));
          const materials = shell ? [this.inside, this.outside] : [this.worn];
          return materials.map((material) => this.#body(geometry, motion, material, material.transparent));
        });
      });
      return this.coating;
    }

    /** Shows the parts in the colours of a quantity of wear, the balls faint; undefined: the parts are plain. */
    #coat(value) {
      if (this.coated === value || (value && !this.coats)) return;
      this.coated = value;
      for (const mesh of this.bare) mesh.visible = !value;
      for (const mesh of [...this.creases, ...(this.coats ?? [])]) mesh.visible = Boolean(value);
      this.veil.visible = Boolean(value);
      this.balls.material = value ? this.faint : this.polish;
      if (!value) return;
      const column = this.head.wear.values.indexOf(value), scale = 256 / Math.log(value.limit / value.low);
      for (const { geometry } of this.coats) {
        const { array } = geometry.getAttribute('color');
        geometry.means[column].forEach((mean, k) => {
          const level = Math.min(255, Math.max(0, Math.floor(scale * Math.log(mean / value.low))));
          for (let j = 0; j < 3; j++) array[4 * k + j] = mean > 0 ? this.colours[3 * level + j] : UNTOUCHED;
          array[4 * k + 3] = NEAR[0] + ((NEAR[1] - NEAR[0]) * level) / 255;
        });
        geometry.getAttribute('color').needsUpdate = true;
      }
    }

    #balls() {
      const array = (width) => new T.InstancedBufferAttribute(new Float32Array(width * this.count), width).setUsage(T.DynamicDrawUsage);
      const geometry = new T.InstancedBufferGeometry(), uniforms = BALL.uniforms();
      geometry.setAttribute('position', new T.BufferAttribute(Float32Array.of(-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0), 3));
      geometry.setIndex([0, 1, 2, 0, 2, 3]);
      geometry.instanceCount = this.count;
      [this.places, this.tints] = [array(3), array(3)];
      for (const [name, values] of Object.entries({ place: this.places, tint: this.tints, size: array(1) })) geometry.setAttribute(name, values);
      let k = 0;
      for (const [many, diameter, mass] of this.head.runs) {
        this.radius.fill(diameter / 2, k, k + many);
        this.mass.fill(mass, k, k += many);
      }
      geometry.getAttribute('size').array.set(this.radius);
      uniforms.up.value.fromArray(this.head.up);
      const made = (more) => new T.ShaderMaterial({ ...BALL, uniforms, ...more });
      this.polish = made({});
      this.faint = made({ uniforms: { ...uniforms, opacity: { value: FAINT } }, transparent: true, depthWrite: false });
      const always = { frustumCulled: false };
      this.balls = Object.assign(new T.Mesh(geometry, this.polish), always);
      // of faint balls only the first surface is seen
      this.veil = Object.assign(new T.Mesh(geometry, made({ colorWrite: false })), always, { visible: false, renderOrder: 1 });
      return [this.balls, this.veil];
    }

    /** The flights of the balls from a frame to the next, from positions [m] and velocities [m/s] in both: for each ball
        the seconds from the frame to its impact, if the parabolas from both ends meet within a part of its radius. After
        no impact the cubic through both states is the parabola itself; after several it is only a smooth curve. */
    #flights(frame) {
      if (this.flown?.frame === frame) return this.flown;
      const { head, count } = this, h = head.times[frame + 1] - head.times[frame];
      const state = [frame, frame + 1].map(() => ({ x: new Float64Array(3 * count), v: new Float64Array(3 * count) }));
      state.forEach(({ x, v }, end) => {
        const from = (frame + end) * 3 * count;
        for (let k = 0; k < 3 * count; k++) {
          x[k] = head.lower[k % 3] + this.step[k % 3] * this.frames.position[from + k];
          v[k] = (square(this.frames.velocity[from + k]) * head.fastest) / 16129;
        }
      });
      if (head.slice) { // balls that left at one end are where they would be beyond it
        const [{ x, v }, to] = state;
        for (let k = 0; k < 3 * count; k += 3) {
          to.x[k] += head.slice * Math.round((x[k] + ((v[k] + to.v[k]) * h) / 2 - to.x[k]) / head.slice);
        }
      }
      const [a, b] = state, impact = new Float64Array(count).fill(NaN), gap = new Float64Array(3 * count), rate = [0, 0, 0];
      for (let k = 0; k < count; k++) {
        let product = 0, size = 0, miss = 0;
        for (let j = 0; j < 3; j++) { // forward parabola minus backward one: gap + rate * seconds
          const i = 3 * k + j, g = head.gravity[j];
          gap[i] = a.x[i] - b.x[i] + b.v[i] * h - (g * h * h) / 2;
          rate[j] = a.v[i] + g * h - b.v[i];
          product += gap[i] * rate[j];
          size += rate[j] ** 2;
        }
        const at = -product / size, radius = this.radius[k];
        for (let j = 0; j < 3; j++) miss += (gap[3 * k + j] += rate[j] * at) ** 2;
        if (size * h * h > (0.02 * radius) ** 2 && at > 0 && at < h && miss < (0.25 * radius) ** 2) impact[k] = at;
      }
      this.flown = { frame, h, a, b, impact, gap };
      return this.flown;
    }

    /** Places balls and bodies as at a time [s] at or after a frame, coloured by a quantity of the head (undefined: none
        that this run has), with flashes of impacts of the last `life` seconds; draw() shows them. */
    place(frame, time, by, life) {
      const { head, count, colours, level, twists } = this;
      const { position, velocity, spin } = this.frames;
      const [place, colour] = [this.places.array, this.tints.array];
      const s = time - head.times[frame], between = s > 0 && frame + 1 < head.times.length;
      const { name, limit, low } = by ?? { low: 1 }, flown = between && this.#flights(frame);
      const share = between ? s / flown.h : 0, [wa, wb, wc, wd] = hermite(share);
      const fast = (f, k) => {
        const from = 3 * (f * count + k);
        const v = [0, 1, 2].map((j) => (square(velocity[from + j]) * head.fastest) / 16129);
        if (twists.length) { // as seen from the frame in which the charge is steady
          const [x, y, z] = [0, 1, 2].map((j) => head.lower[j] + this.step[j] * position[from + j]), w = twists.subarray(6 * f, 6 * f + 6);
          v[0] -= w[0] + w[4] * z - w[5] * y;
          v[1] -= w[1] + w[5] * x - w[3] * z;
          v[2] -= w[2] + w[3] * y - w[4] * x;
        }
        return Math.hypot(...v);
      };
      const spun = (f, k) => (spin[f * count + k] ** 2 * head.spinning) / 65025;
      const of = name === 'spin' ? spun : fast;
      for (let k = 0; k < count; k++) {
        let value;
        if (!between) {
          for (let j = 0; j < 3; j++) place[3 * k + j] = head.lower[j] + this.step[j] * position[3 * (frame * count + k) + j];
          value = of(frame, k);
        } else {
          const { h, a, b, impact, gap } = flown, at = impact[k], late = s > at, t = late ? s - h : s;
          for (let j = 0; j < 3; j++) {
            const i = 3 * k + j;
            place[i] = at === at // each parabola ends in the middle of the small gap between them
              ? (late ? b.x[i] + b.v[i] * t : a.x[i] + a.v[i] * t) + (head.gravity[j] * t * t) / 2 - (gap[i] / 2) * (late ? t / (h - at) : t / at)
              : wa * a.x[i] + wb * b.x[i] + h * (wc * a.v[i] + wd * b.v[i]);
          }
          if (head.slice) place[3 * k] -= head.slice * Math.round(place[3 * k] / head.slice);
          value = at === at ? of(frame + late, k) : (1 - share) * of(frame, k) + share * of(frame + 1, k);
        }
        if (name === 'energy') value = (this.mass[k] * value * value) / 2;
        level[k] = Math.min(255, Math.floor((256 * value) / limit));
        for (let j = 0; j < 3; j++) colour[3 * k + j] = low ? 1 : colours[3 * level[k] + j];
      }
      this.places.needsUpdate = this.tints.needsUpdate = true;
      this.#coat(low ? by : undefined);
      this.move(frame, share);
      this.time = time;
      this.life = life;
    }

    /** Shows a state: positions of the balls (n, 3) [m], their colours 0..255, poses of the motions (m, 3, 4). */
    show(positions, levels, poses) {
      this.places.array.set(positions);
      for (let k = 0; k < 3 * this.count; k++) this.tints.array[k] = this.colours[3 * levels[Math.floor(k / 3)] + (k % 3)];
      this.places.needsUpdate = this.tints.needsUpdate = true;
      this.poses = poses;
      this.move(0, 0);
    }

    /** Turns the flashes that are seen to the camera, a little in front of the balls that hit. */
    #flash() {
      const { flashes, sparks, camera, time, life } = this, matrix = sparks.instanceMatrix.array;
      camera.updateMatrixWorld();
      const turn = camera.matrixWorld.elements, place = new T.Vector3(), lift = 2 * this.radius[0];
      const container = this.world.matrix.clone().multiply((this.moving[this.head.carrier] ?? new T.Group()).matrix);
      sparks.count = 0;
      for (let k = 0; k < flashes.length && sparks.count < MOST_FLASHES; k += 5) {
        const age = (time - flashes[k]) / life;
        if (!(age >= 0 && age < 1)) continue;
        const at = 16 * sparks.count++, size = flashes[k + 4] * (1 - age);
        place.fromArray(flashes, k + 1).applyMatrix4(container);
        place.addScaledVector(camera.position.clone().sub(place).normalize(), lift);
        for (let j = 0; j < 12; j++) matrix[at + j] = j % 4 < 3 ? size * turn[j] : 0;
        place.toArray(matrix, at + 12);
        matrix[at + 15] = 1;
      }
      sparks.instanceMatrix.needsUpdate = true;
      sparks.visible = sparks.count > 0;
    }

    draw() {
      this.#flash();
      this.renderer.render(this.scene, this.camera);
    }

    /** Promise of the milliseconds that one picture takes. */
    async cost() {
      const gl = this.renderer.getContext(), begin = performance.now();
      this.draw();
      const done = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
      gl.flush();
      while (done && gl.getSyncParameter(done, gl.SYNC_STATUS) !== gl.SIGNALED) {
        if (gl.isContextLost()) return Infinity;
        await new Promise((resolve) => { setTimeout(resolve, 2); });
      }
      return performance.now() - begin;
    }

    /** The colours of container and bodies, for light or dark surroundings. */
    ink(dark) {
      this.steel.color.set(dark ? 0x9aa3b2 : 0x6b7280);
      this.shell.color.set(dark ? 0xb8c8e6 : 0x52698c);
      this.shell.opacity = dark ? 0.1 : 0.13;
      this.rim.color.set(dark ? 0x6f7d95 : 0x8b97aa);
    }

    resize(width, height, ratio) {
      this.renderer.setPixelRatio(Math.min(ratio, 2));
      this.renderer.setSize(width, height, false);
      super.resize(width, height);
    }

    /** Centres as drawn, Float32Array (n, 3) [m]. */
    positions() {
      return this.places.array.slice();
    }
  }

  return { Eye, View, unpack, bytesOf };
})();
