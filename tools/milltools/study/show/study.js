/* The linked pictures of the page of a study: trade-off, contours over two keys, parallel coordinates. A click on a
   design chooses it in all of them and shows its numbers and, if the page has it, its mill.

   For tests, window.millStudy: choose(k), chosen, brush(axis, low, high), shown() (numbers of the designs shown). */
'use strict';

(() => {
  const data = JSON.parse(document.getElementById('data').textContent);
  const { keys, aims, designs } = data;
  const SPACE = 'http://www.w3.org/2000/svg';
  const WIDTH = 520, HEIGHT = 380, LEFT = 80, RIGHT = 18, TOP = 16, BOTTOM = 44;
  const brushes = new Map(); // number of a parallel axis -> [low, high]
  let chosen = data.best, pair = 0;

  const at = (id) => document.getElementById(id);
  function add(parent, name, attributes, text) {
    const element = document.createElementNS(SPACE, name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    if (text !== undefined) element.textContent = text;
    parent.append(element);
    return element;
  }
  const label = (one) => one.name + (one.unit ? ` [${one.unit}]` : '');
  const tell = (value) => String(Number(value.toPrecision(4)));

  // ---- scales

  function ends(values) {
    const known = values.filter((v) => v !== null);
    const low = Math.min(...known), high = Math.max(...known);
    return low < high ? [low, high] : [low - 0.5, high + 0.5];
  }
  function ticks(low, high, most = 6) {
    const raw = (high - low) / most, power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 2.5, 5, 10].map((m) => m * power).find((s) => s >= raw * 0.999);
    const found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
    return found;
  }
  const own = designs.filter((d) => d.state === 'done').map((d) => d.aims[0]);
  const [least, most] = ends(own.length ? own : designs.map((d) => d.aims[0]));
  function shade(value) {
    if (value === null) return 'gray';
    const last = data.colours.length / 3 - 1;
    const k = 3 * Math.round(last * Math.min(1, Math.max(0, (value - least) / (most - least))));
    return `rgb(${data.colours.slice(k, k + 3).join(',')})`;
  }

  function frame(svg, x, y, xname, yname, width = WIDTH) {
    svg.setAttribute('viewBox', `0 0 ${width} ${HEIGHT}`);
    svg.replaceChildren();
    const px = (v) => LEFT + ((v - x[0]) / (x[1] - x[0])) * (width - LEFT - RIGHT);
    const py = (v) => HEIGHT - BOTTOM - ((v - y[0]) / (y[1] - y[0])) * (HEIGHT - TOP - BOTTOM);
    const back = add(svg, 'g', {}), axes = add(svg, 'g', {});
    for (const v of ticks(...x)) {
      add(axes, 'line', { class: 'rule', x1: px(v), x2: px(v), y1: HEIGHT - BOTTOM, y2: HEIGHT - BOTTOM + 4 });
      add(axes, 'text', { x: px(v), y: HEIGHT - BOTTOM + 16, 'text-anchor': 'middle' }, tell(v));
    }
    for (const v of ticks(...y)) {
      add(axes, 'line', { class: 'rule', x1: LEFT - 4, x2: LEFT, y1: py(v), y2: py(v) });
      add(axes, 'text', { x: LEFT - 7, y: py(v) + 4, 'text-anchor': 'end' }, tell(v));
    }
    add(axes, 'path', { class: 'rule', d: `M${LEFT} ${TOP}V${HEIGHT - BOTTOM}H${width - RIGHT}` });
    add(axes, 'text', { x: (LEFT + width - RIGHT) / 2, y: HEIGHT - 8, 'text-anchor': 'middle' }, xname);
    add(axes, 'text', { x: -(TOP + HEIGHT - BOTTOM) / 2, y: 12, transform: 'rotate(-90)', 'text-anchor': 'middle' }, yname);
    return { px, py, back };
  }

  function dot(svg, k, x, y) {
    if (x === null || y === null) return;
    const radius = k === data.best ? 7 : 5;
    const point = add(svg, 'circle', { class: 'dot', 'data-design': k, cx: x, cy: y, r: radius, fill: shade(designs[k].aims[0]) });
    add(point, 'title', {}, `${designs[k].name}\n${designs[k].told.map((t, n) => `${aims[n].name}: ${t}`).join('\n')}`);
    point.addEventListener('click', () => choose(k));
  }

  // ---- the pictures

  function tradeoff() {
    if (!data.pairs.length) return;
    const { x: a, y: b, slope } = data.pairs[pair], svg = at('tradeoff').querySelector('svg');
    at('tradeoff').hidden = false;
    const range = (n) => {
      const [low, high] = ends(designs.map((d) => d.aims[n]));
      return [slope !== null && low > 0 ? 0 : low - 0.05 * (high - low), high + 0.05 * (high - low)];
    };
    const x = range(a), y = range(b);
    const { px, py, back } = frame(svg, x, y, label(aims[a]), label(aims[b]));
    for (const one of data.limits) {
      const along = one.aim === a ? x : one.aim === b ? y : null;
      if (!along || one.limit <= along[0] || one.limit >= along[1]) continue;
      const [low, high] = one.sign > 0 ? [one.limit, along[1]] : [along[0], one.limit];
      const box = one.aim === a ? [px(low), py(y[1]), px(high), py(y[0])] : [px(x[0]), py(high), px(x[1]), py(low)];
      add(back, 'rect', { class: 'banned', x: box[0], y: box[1], width: box[2] - box[0], height: box[3] - box[1] });
      const d = one.aim === a ? `M${px(one.limit)} ${py(y[0])}V${py(y[1])}` : `M${px(x[0])} ${py(one.limit)}H${px(x[1])}`;
      add(back, 'path', { class: 'limit', d });
      add(back, 'text', { x: one.aim === a ? px(one.limit) + 4 : px(x[0]) + 6, y: one.aim === a ? TOP + 10 : py(one.limit) - 4 }, `does not meet ${one.text}`);
    }
    if (slope !== null && x[0] === 0 && y[0] === 0) {
      const slopes = designs.filter((d) => d.aims[a] > 0).map((d) => d.aims[b] / d.aims[a]);
      for (const s of ticks(...ends(slopes), 5).filter((v) => v > 0)) {
        const end = s * x[1] <= y[1] ? [x[1], s * x[1]] : [y[1] / s, y[1]];
        add(back, 'line', { class: 'rule', x1: px(0), y1: py(0), x2: px(end[0]), y2: py(end[1]), 'stroke-dasharray': '4 3' });
        add(back, 'text', { class: 'faint', x: px(end[0]) - 3, y: py(end[1]) - 3, 'text-anchor': 'end' }, `${tell(s)} ${slope}`);
      }
    }
    if (pair === 0 && data.front.length > 1) {
      const line = data.front.map((k) => designs[k].aims).sort((p, q) => p[a] - q[a]);
      add(back, 'path', { class: 'rule', d: `M${line.map((v) => `${px(v[a])} ${py(v[b])}`).join('L')}` });
    }
    designs.forEach((d, k) => dot(svg, k, d.aims[a] === null ? null : px(d.aims[a]), d.aims[b] === null ? null : py(d.aims[b])));
  }

  function plane() {
    const field = data.plane, svg = at('plane').querySelector('svg');
    if (!field) return;
    at('plane').hidden = false;
    /** @returns {[number, number]} */
    const edge = (v) => {
      const first = v.length > 1 ? (v[1] - v[0]) / 2 : 0.5, last = v.length > 1 ? (v[v.length - 1] - v[v.length - 2]) / 2 : 0.5;
      return [v[0] - first, v[v.length - 1] + last];
    };
    const x = edge(field.xs), y = edge(field.ys);
    const { px, py, back } = frame(svg, x, y, label(keys[field.x]), label(keys[field.y]));
    const inside = (v, [low, high]) => v >= low && v <= high;
    const border = (v, k, [low, high]) => (k <= 0 ? low : k >= v.length ? high : (v[k - 1] + v[k]) / 2);
    field.value.forEach((row, j) => row.forEach((value, i) => {
      if (value === null) return;
      const [x0, x1] = [border(field.xs, i, x), border(field.xs, i + 1, x)], [y0, y1] = [border(field.ys, j, y), border(field.ys, j + 1, y)];
      const here = designs.filter((d) => inside(d.keys[field.x], [x0, x1]) && inside(d.keys[field.y], [y0, y1]));
      const off = here.length > 0 && here.every((d) => d.state === 'not allowed');
      add(back, 'rect', { opacity: off ? 0.25 : 1, x: px(x0) - 0.3, y: py(y1) - 0.3, width: px(x1) - px(x0) + 0.6, height: py(y0) - py(y1) + 0.6, fill: shade(value) });
    }));
    designs.forEach((d, k) => dot(svg, k, px(d.keys[field.x]), py(d.keys[field.y])));
    const words = `Colour: ${label(aims[0])}, ${tell(least)} (dark) to ${tell(most)} (bright)`;
    const pale = designs.some((d) => d.state === 'not allowed') ? '; pale: not allowed' : '';
    at('plane').querySelector('figcaption').textContent = words + pale + (field.others ? `; ${field.others}` : '') + '.';
  }

  const strings = [...keys.map((one, n) => ({ ...one, of: (d) => d.keys[n] })), ...aims.map((one, n) => ({ ...one, words: [], of: (d) => d.aims[n] }))];

  function parallel() {
    const svg = at('parallel').querySelector('svg'), width = Math.max(WIDTH, 150 * strings.length), height = 330;
    at('parallel').hidden = false;
    svg.setAttribute('viewBox', `0 0 ${width} ${height}`);
    svg.style.maxWidth = `${1.3 * width}px`; // few keys: no large letters
    svg.replaceChildren();
    const px = (n) => 70 + (n * (width - 140)) / Math.max(1, strings.length - 1);
    const scales = strings.map((one) => {
      const [low, high] = ends(designs.map(one.of));
      return { low, high, y: (v) => 280 - (230 * (v - low)) / (high - low), value: (y) => low + ((280 - y) * (high - low)) / 230 };
    });
    designs.forEach((d, k) => {
      const points = strings.map((one, n) => (one.of(d) === null ? null : `${px(n)} ${scales[n].y(one.of(d))}`)).filter(Boolean);
      const line = add(svg, 'path', { class: 'string', 'data-design': k, d: `M${points.join('L')}`, stroke: shade(d.aims[0]) });
      add(line, 'title', {}, d.name);
      line.addEventListener('click', () => choose(k));
    });
    strings.forEach((one, n) => {
      const scale = scales[n], x = px(n);
      add(svg, 'line', { class: 'rule', x1: x, x2: x, y1: 50, y2: 280 });
      const marks = one.words.length ? one.words.map((_, k) => k) : ticks(scale.low, scale.high, 5);
      for (const v of marks) add(svg, 'text', { x: x - 5, y: scale.y(v) + 4, 'text-anchor': 'end' }, one.words.length ? one.words[v] : tell(v));
      const words = label(one).split(' ');
      let line = '', row = 0;
      const rows = [];
      for (const word of words) {
        if (line && (line + word).length > 20) { rows.push(line); line = ''; }
        line += (line ? ' ' : '') + word;
      }
      rows.push(line);
      for (const text of rows.slice(0, 3)) add(svg, 'text', { x, y: 12 + 13 * row++, 'text-anchor': 'middle' }, text);
      const mark = add(svg, 'rect', { class: 'brush', x: x - 9, width: 18, y: 0, height: 0 });
      const grip = add(svg, 'rect', { class: 'grip', x: x - 14, width: 28, y: 44, height: 242, 'data-axis': n });
      let from = null;
      const place = (event) => {
        const box = svg.getBoundingClientRect();
        return Math.min(280, Math.max(50, ((event.clientY - box.top) * height) / box.height));
      };
      grip.addEventListener('pointerdown', (event) => { from = place(event); grip.setPointerCapture(event.pointerId); });
      grip.addEventListener('pointermove', (event) => { if (from !== null) between(from, place(event)); });
      grip.addEventListener('pointerup', (event) => {
        if (Math.abs(place(event) - from) < 4) brushes.delete(n);
        from = null;
        show();
      });
      const between = (p, q) => { brushes.set(n, [scale.value(Math.max(p, q)), scale.value(Math.min(p, q))]); show(); };
      one.mark = () => {
        const kept = brushes.get(n);
        mark.setAttribute('y', kept ? scale.y(kept[1]) : 0);
        mark.setAttribute('height', kept ? scale.y(kept[0]) - scale.y(kept[1]) : 0);
      };
    });
  }

  // ---- the choice

  function inside(d) {
    for (const [n, [low, high]] of brushes) {
      const value = strings[n].of(d);
      if (value === null || value < low || value > high) return false;
    }
    return true;
  }

  function show() {
    for (const one of strings) one.mark();
    for (const element of document.querySelectorAll('#linked [data-design]')) {
      const k = Number(element.dataset.design);
      element.classList.toggle('off', !inside(designs[k]));
      element.classList.toggle('bad', designs[k].state !== 'done');
      element.classList.toggle('chosen', k === chosen);
      if (k === chosen && element.classList.contains('dot')) element.parentNode.append(element);
    }
  }

  function choose(k) {
    chosen = k;
    show();
    if (k === null) return;
    const d = designs[k], box = at('told');
    box.hidden = false;
    box.replaceChildren();
    const line = (text, name = 'p') => { const p = document.createElement(name); p.textContent = text; box.append(p); return p; };
    line(d.name + (d.state === 'done' ? '' : ` (${d.state})`), 'strong');
    line(d.told.map((text, n) => `${aims[n].name}: ${text || '?'}`).join('; ').replaceAll('+-', '±') + ' (95 %)');
    line('').append(Object.assign(document.createElement('code'), { textContent: d.set }));
    at('design').value = k;
    let turning = false;
    for (const mill of document.querySelectorAll('.turning')) {
      mill.hidden = Number(mill.dataset.design) !== k;
      turning ||= !mill.hidden;
    }
    if (at('no-mill')) at('no-mill').hidden = turning;
  }

  const order = designs.map((_, k) => k).sort((p, q) => (aims[0].goal === 'maximise' ? -1 : 1) * ((designs[p].aims[0] ?? -Infinity) - (designs[q].aims[0] ?? -Infinity)));
  for (const k of order) {
    const words = designs[k].name + (designs[k].state === 'done' ? '' : ` (${designs[k].state})`) + (data.mills.includes(k) ? ' \u25b6' : '');
    at('design').append(new Option(words, k));
  }
  at('design').addEventListener('change', () => choose(Number(at('design').value)));
  at('clear').addEventListener('click', () => { brushes.clear(); show(); });
  const choice = at('pairs').querySelector('select');
  data.pairs.forEach((one, k) => choice.append(new Option(`${aims[one.y].name} over ${aims[one.x].name}`, k)));
  at('pairs').hidden = data.pairs.length < 2;
  choice.addEventListener('change', () => { pair = Number(choice.value); tradeoff(); show(); });
  document.querySelector('.controls').hidden = false;
  tradeoff();
  plane();
  parallel();
  choose(chosen);
  window.millStudy = {
    choose,
    get chosen() { return chosen; },
    brush(axis, low, high) { brushes.set(axis, [low, high]); show(); },
    shown: () => designs.map((_, k) => k).filter((k) => inside(designs[k])),
  };
})();
