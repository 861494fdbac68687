/* The pictures of the studio as inline SVG. Each function returns the text of an <svg> that is as wide as asked, so that
   letters keep their size. Colours are those of studio.css. */
'use strict';

const MillCharts = (() => {
  const W = MillWords;
  // as milltools/figures/style.py: colours that all kinds of colour vision tell apart, and dashes
  const KINDS = {
    ball_ball: ['#1f86c9', ''], ball_drum: ['#d55e00', '9 3'], ball_wall: ['#009e73', '9 3 3 3'],
    ball_shaft: ['#7f7f7f', '2 3'], ball_blade: ['#b8609a', '5 3'],
  };
  const MORE = [['#d55e00', '9 3'], ['#009e73', '9 3 3 3'], ['#b8609a', '5 3'], ['#b58900', '12 3'], ['#2aa1b3', '6 2 2 2'],
    ['#8a6d3b', '3 3'], ['#7b61c9', '8 5'], ['#7f7f7f', '2 3']];

  const escape = (text) => String(text).replace(/[&<>"]/g, (c) => ({ '&': '&amp;', '<': '&lt;', '>': '&gt;', '"': '&quot;' }[c]));
  const fixed = (value) => (Math.round(10 * value) / 10).toString();

  /** {kind: [colour, dashes]} of a mill's kinds: bodies get looks that no other kind has. */
  function looks(kinds) {
    const own = kinds.filter((kind) => !(kind in KINDS));
    const free = MORE.filter(([colour]) => !kinds.some((kind) => KINDS[kind]?.[0] === colour));
    return Object.fromEntries(kinds.map((kind) => [kind, KINDS[kind] ?? free[own.indexOf(kind) % free.length]]));
  }

  /** Round numbers between two ends, about `count` of them. */
  function ticks(low, high, count) {
    const rough = (high - low) / Math.max(1, count), power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= rough * 0.999);
    const found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
    return found;
  }

  /** An axis that keeps its ends until the data leave it, or need less than a third of it: nothing jumps. */
  class Axis {
    constructor(grow = 0.25) { this.grow = grow; }

    fit(low, high, fixedLow) {
      const span = high - low || Math.abs(high) || 1;
      const kept = this.low !== undefined && low >= this.low && high <= this.high && span > (this.high - this.low) / 3;
      if (!kept) {
        this.low = fixedLow ? low : low - this.grow * span;
        this.high = high + this.grow * span;
        if (low >= 0) this.low = Math.max(0, this.low);
      }
      return this;
    }
  }

  const path = (points) => points.map(([x, y], k) => `${k ? 'L' : 'M'}${fixed(x)} ${fixed(y)}`).join('');

  /** A frame with axes: {svg(content), x, y}; `sides`: {x, y} of {low, high, log, label, ticks: [[value, text]]}. */
  function frame(width, height, name, sides) {
    const left = 58, right = width - 14, top = 10, bottom = height - 44;
    const place = ({ low, high, log }, from, to) => {
      const of = log ? Math.log10 : (value) => value, [a, b] = [of(low), of(high)];
      return (value) => from + ((of(value) - a) / (b - a)) * (to - from);
    };
    const x = place(sides.x, left, right), y = place(sides.y, bottom, top);
    let marks = '';
    for (const [value, text] of sides.x.ticks) marks += `<path class="grid" d="M${fixed(x(value))} ${top}V${bottom}"/><text x="${fixed(x(value))}" y="${bottom + 17}" text-anchor="middle">${escape(text)}</text>`;
    for (const [value, text] of sides.y.ticks) marks += `<path class="grid" d="M${left} ${fixed(y(value))}H${right}"/><text x="${left - 7}" y="${fixed(y(value) + 4)}" text-anchor="end">${escape(text)}</text>`;
    const svg = (content) => `<svg viewBox="0 0 ${width} ${height}" width="${width}" height="${height}" aria-hidden="true">${marks}`
      + `<clipPath id="clip-${name}"><rect x="${left}" y="${top}" width="${right - left}" height="${bottom - top}"/></clipPath>`
      + `<g clip-path="url(#clip-${name})">${content}</g><path class="axis" d="M${left} ${top}V${bottom}H${right}"/>`
      + `<text class="label" x="${(left + right) / 2}" y="${height - 6}" text-anchor="middle">${escape(sides.x.label)}</text>`
      + `<text class="label" transform="translate(13 ${(top + bottom) / 2}) rotate(-90)" text-anchor="middle">${escape(sides.y.label)}</text></svg>`;
    return { svg, x, y, left, right, top, bottom };
  }

  /** The axis for values, in the unit with a prefix that suits them: {unit, one}. */
  function prefixed(most, unit) {
    const thousands = most > 0 ? Math.min(Math.max(Math.floor(Math.log10(most) / 3 + 1e-9), -4), 3) : 0;
    return { one: 1000 ** thousands, unit: `${{ '-4': 'p', '-3': 'n', '-2': 'µ', '-1': 'm', 0: '', 1: 'k', 2: 'M', 3: 'G' }[thousands]}${unit}` };
  }

  const linear = (axis, count, one) => ticks(axis.low / one, axis.high / one, count).map((value) => [value * one, W.number(value)]);

  /** Power of the drive over the simulated time: means with their standard errors of designs, and the first one's course.
      `designs`: [{means, course, ghost}]; `axes`: {x, y} kept from picture to picture. */
  function power(width, height, designs, axes) {
    const band = (one) => (one.error === null ? [one.value, one.value] : [one.value - one.error, one.value + one.error]);
    const times = designs.flatMap(({ means, course }) => [means[means.length - 1]?.time ?? 0, course[course.length - 1]?.[0] ?? 0]);
    const values = designs.flatMap(({ means, course }) => [...means.slice(-1).flatMap(band), ...course.map(([, value]) => value).sort((a, b) => a - b)
      .filter((_, k, all) => k >= 0.05 * all.length && k <= 0.95 * all.length)]);
    const x = axes.x.fit(0, Math.max(...times, 1e-3), true), y = axes.y.fit(Math.min(...values, 0), Math.max(...values, 1e-9));
    const second = prefixed(x.high, 's'), watt = prefixed(Math.max(Math.abs(y.low), y.high), 'W');
    const { svg, x: px, y: py } = frame(width, height, 'power', {
      x: { ...x, label: `simulated time [${second.unit}]`, ticks: linear(x, width / 110, second.one) },
      y: { ...y, label: `power of the drive [${watt.unit}]`, ticks: linear(y, height / 45, watt.one) },
    });
    const content = designs.map(({ means, course, ghost }) => {
      const sure = means.filter((one) => one.error !== null), point = (time, value) => [px(time), py(value)];
      const outline = [...sure.map((one) => point(one.time, band(one)[1])), ...sure.map((one) => point(one.time, band(one)[0])).reverse()];
      return (ghost ? '' : `<path class="course" d="${path(course.map(([t, v]) => point(t, v)))}"/>`)
        + (outline.length > 2 ? `<path class="band${ghost ? ' ghost' : ''}" d="${path(outline)}Z"/>` : '')
        + `<path class="mean${ghost ? ' ghost' : ''}" d="${path(means.map((one) => point(one.time, one.value)))}"/>`;
    });
    return svg(content.reverse().join(''));
  }

  /** Bins of a spectrum joined to about ten a decade: [[middle, value a second and decade], ...]. */
  function density(edges, bins, duration) {
    const points = [];
    let from = 0, total = 0;
    for (let k = 0; k < bins.length; k++) {
      if (!(edges[k] > 0)) { from = k + 1; continue; }
      total += bins[k];
      const wide = Math.log10(edges[k + 1] / edges[from]);
      if (wide < 0.0999) continue;
      points.push([Math.sqrt(edges[from] * edges[k + 1]), total / wide / duration]);
      from = k + 1;
      total = 0;
    }
    return points;
  }

  const decades = (low, high, every = 1) => {
    const found = [];
    for (let k = Math.ceil(Math.log10(low) - 1e-9); k <= Math.log10(high) + 1e-9; k++) if (k % every === 0) found.push(10 ** k);
    return found;
  };

  const tenTo = (value) => (value >= 0.01 && value <= 1000 ? W.number(value) : W.number(value).replace(/^1×/, ''));

  /** Impacts over their energy. `designs`: [{spectrum, duration, ghost}]; `what`: "count" or "dissipation"; `shown`: kinds,
      "all" among them. */
  function spectrum(width, height, designs, { what, shown, threshold, kinds, axes }) {
    const style = looks(kinds), lines = [];
    for (const { spectrum: of, duration, ghost } of designs) {
      for (const kind of shown) {
        const points = density(of.edges, of[what][kind] ?? [], duration).filter(([, value]) => value > 0);
        if (points.length) lines.push({ kind, ghost, points });
      }
    }
    const most = Math.max(...lines.flatMap((line) => line.points.map(([, value]) => value)), 1e-12);
    const seen = lines.flatMap((line) => line.points.filter(([, value]) => value > most * 1e-5));
    const ends = (values, spread) => [10 ** Math.floor(Math.log10(Math.min(...values)) - spread), 10 ** Math.ceil(Math.log10(Math.max(...values)) + spread)];
    const [low, high] = seen.length ? ends(seen.map(([energy]) => energy), 0) : [1e-6, 1e-1];
    axes.x.low = Math.min(axes.x.low ?? low, low);
    axes.x.high = Math.max(axes.x.high ?? high, high);
    const [bottom, top] = seen.length ? ends(seen.map(([, value]) => value), 0) : [1, 1e5];
    axes.y.low = Math.max(top * 1e-6, Math.min(axes.y.low ?? bottom, bottom));
    axes.y.high = Math.max(axes.y.high ?? top, top);
    const every = (axis, room) => Math.max(1, Math.ceil(Math.log10(axis.high / axis.low) / room));
    const side = (axis, label, room) => ({ ...axis, log: true, label, ticks: decades(axis.low, axis.high, every(axis, room)).map((value) => [value, tenTo(value)]) });
    const { svg, x, y, top: above, bottom: below } = frame(width, height, 'spectrum', {
      x: side(axes.x, 'normal energy of an impact [J]', width / 60),
      y: side(axes.y, what === 'count' ? 'impacts [1/(s decade)]' : 'power lost [W/decade]', height / 32),
    });
    const content = lines.map(({ kind, ghost, points }) => {
      const [colour, dashes] = style[kind] ?? ['currentColor', ''];
      return `<path class="curve${ghost ? ' ghost' : ''}" stroke="${colour}" stroke-dasharray="${ghost ? '2 4' : dashes}" d="${path(points.map(([e, v]) => [x(e), y(v)]))}"/>`;
    });
    const mark = `<path class="threshold" d="M${fixed(x(threshold))} ${above}V${below}"/>`;
    return svg(mark + content.reverse().join(''));
  }

  /** Where the power goes: ins on the left, outs on the right, each as high as its power. */
  function flow(width, height, { ins, outs }, kinds) {
    const style = looks(kinds), total = Math.max(ins.reduce((a, b) => a + b.value, 0), outs.reduce((a, b) => a + b.value, 0));
    const narrow = width < 480, bar = 12, wide = narrow ? 146 : 190, leftLabel = narrow ? 104 : 150;
    const x = [leftLabel, (leftLabel + width - wide) / 2, width - wide];
    const high = height - 26, gap = 12, rest = high - gap * (Math.max(ins.length, outs.length) - 1);
    const size = (value) => Math.max(1, (rest * value) / total);
    const stack = (rows) => {
      let y = 13 + (high - rows.reduce((a, row) => a + size(row.value), 0) - gap * (rows.length - 1)) / 2;
      return rows.map((row) => { const at = y; y += size(row.value) + gap; return { ...row, y: at, h: size(row.value) }; });
    };
    const look = (row) => (row.kind ? style[row.kind][0] : row.kept ? '#8a6d3b' : '#5c6f8f');
    const whole = size(total), middle = 13 + (high - whole) / 2;
    let svg = '';
    const ribbon = (x0, y0, x1, y1, h, colour) => {
      const m = (x0 + x1) / 2;
      return `<path class="ribbon" fill="${colour}" d="M${x0} ${fixed(y0)}C${m} ${fixed(y0)} ${m} ${fixed(y1)} ${x1} ${fixed(y1)}V${fixed(y1 + h)}C${m} ${fixed(y1 + h)} ${m} ${fixed(y0 + h)} ${x0} ${fixed(y0 + h)}Z"/>`;
    };
    const label = (row, at, anchor, y) => {
      const name = row.kept ? (anchor === 'end' ? 'from the balls' : 'stays in the balls') : row.kind ? `${W.kind(row.name)} contacts` : `${anchor === 'end' ? '' : 'back to '}motion ${row.name}`;
      return `<text x="${at}" y="${fixed(y - 2)}" text-anchor="${anchor}">${escape(name)}</text>`
        + `<text class="value" x="${at}" y="${fixed(y + 13)}" text-anchor="${anchor}">${escape(`${W.quantity(row.value, 'W')}, ${W.share(row.value / total)}`)}</text>`;
    };
    const side = (rows, at, text, anchor, draw) => {
      let used = middle, free = 13;
      const placed = stack(rows), room = 32;
      placed.forEach((row, k) => {
        svg += draw(row, used) + `<rect x="${at}" y="${fixed(row.y)}" width="${bar}" height="${fixed(row.h)}" fill="${look(row)}"/>`;
        used += row.h;
        const y = Math.min(Math.max(row.y + row.h / 2, free), height - 14 - room * (placed.length - 1 - k));
        free = y + room;
        svg += label(row, text, anchor, y);
      });
    };
    side(ins, x[0], x[0] - 8, 'end', (row, used) => ribbon(x[0] + bar, row.y, x[1], used, row.h, look(row)));
    side(outs, x[2], x[2] + bar + 8, 'start', (row, used) => ribbon(x[1] + bar, used, x[2], row.y, row.h, look(row)));
    svg += `<rect class="trunk" x="${x[1]}" y="${fixed(middle)}" width="${bar}" height="${fixed(whole)}"/>`;
    return `<svg viewBox="0 0 ${width} ${height}" width="${width}" height="${height}" aria-hidden="true">${svg}</svg>`;
  }

  return { Axis, looks, power, spectrum, flow, density, escape };
})();
