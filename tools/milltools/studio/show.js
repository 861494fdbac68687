/* Writes what is known about a design into the page: the finding, tiles, charts, the balance and the comparison. */
'use strict';

const MillShow = (() => {
  const W = MillWords, R = MillResults, C = MillCharts;
  const UNKNOWN = 'not yet known';

  const part = (id) => document.getElementById(id);
  /** Writes only what has changed, so that nothing flickers and a screen reader is not disturbed. */
  function write(id, text) {
    const place = part(id);
    if (place.textContent !== text) place.textContent = text;
  }

  const sure = ({ value, error }, unit) => (value === null ? UNKNOWN : W.brief(value, error, unit));

  /** The error alone: "9 W"; '' if it is not known. */
  const spread = (one, unit) => sure(one, unit).split('±')[1]?.trim() ?? '';

  class Show {
    record; frozen;

    constructor() {
      this.axes = { power: { x: new C.Axis(), y: new C.Axis(0.12) }, spectrum: { x: {}, y: {} } };
      this.size = new Map();
      this.watcher = new ResizeObserver((entries) => {
        for (const { target, contentRect } of entries) this.size.set(target.parentElement.id, [Math.floor(contentRect.width), Math.floor(contentRect.height)]);
        if (this.record) this.all(this.record, this.frozen);
      });
      for (const box of document.querySelectorAll('.drawing')) this.watcher.observe(box);
    }

    /** Another mill: the axes begin anew. */
    begin() {
      this.axes = { power: { x: new C.Axis(), y: new C.Axis(0.12) }, spectrum: { x: {}, y: {} } };
    }

    get which() { return Number(part('threshold').value); }

    all(record, frozen) {
      Object.assign(this, { record, frozen });
      const power = record.power();
      this.#finding(record, power);
      this.#tiles(record, power);
      this.#power(record, frozen, power);
      this.#flow(record);
      this.#spectrum(record, frozen);
      this.#balance(record);
      this.#compare(record, frozen);
    }

    /** The first words: what takes the power. */
    #finding(record, power) {
      const flows = record.flows(), losses = flows?.outs.filter((row) => row.kind) ?? [];
      const total = losses.reduce((sum, row) => sum + row.value, 0);
      if (!losses.length) return write('finding', record.state?.time > 0 ? 'No contacts yet: the balls fly' : 'The mill is ready');
      const shares = losses.slice(0, 2).map((row, k) => `${W.share(row.value / total)} ${k ? 'into' : 'goes into'} ${W.kind(row.name).replace('-', '\u2011')} contacts`); // not broken at the hyphen
      const whole = power.value === null ? `${W.quantity(total, 'W')} so far` : W.brief(power.value, power.error, 'W');
      return write('finding', `The balls take ${whole}: ${shares.join(', ')}`);
    }

    #tiles(record, power) {
      const { state, statistics } = record;
      const from = record.mill.sample_from ?? null;
      write('power', power.value === null ? UNKNOWN : W.quantity(power.value, 'W'));
      write('power-more', power.value === null ? `statistics begin ${from === null ? 'when the mill is steady' : `at ${W.quantity(from, 's')}`}`
        : power.error === null ? 'its error is not yet known: too few turns' : `± ${spread(power, 'W')}, ${W.share(power.error / Math.abs(power.value))}`);
      const { rate, perJoule } = record.hard(this.which);
      const off = spread(rate, '/s'), own = record.threshold(3);
      write('own-threshold', own > 0 ? W.quantity(own, 'J') : 'half of losses');
      write('hard', rate.value === null ? UNKNOWN : W.quantity(rate.value, '/s'));
      write('hard-more', perJoule.value === null ? 'per work: not yet known' : `${off && `± ${off}; `}${sure(perJoule, '/J')} of work`);
      write('contacts', state ? W.count(state.contacts) : UNKNOWN);
      const all = record.precise('rate.all');
      write('contacts-more', [all.value === null ? '' : `${W.quantity(all.value, '/s')} of simulated time`, state?.rate > 0 ? `${W.quantity(state.rate, '/s')} of your time` : '']
        .filter(Boolean).join('; ') || (statistics ? '' : UNKNOWN));
      const books = record.balance();
      write('books', books ? W.small(books.relative) : UNKNOWN);
      write('books-more', books ? 'of the energy turned over since the start' : UNKNOWN);
    }

    #draw(id, markup, words) {
      const [width, height] = this.size.get(`figure-${id}`) ?? [0, 0];
      if (width > 0) part(`figure-${id}`).querySelector('.drawing').innerHTML = markup(width, height);
      write(`${id}-text`, words);
    }

    #power(record, frozen, power) {
      const designs = [record, frozen].filter(Boolean).map((one, k) => ({ means: one.means, course: one.powers(), ghost: k > 0 }));
      write('power-chart-title', power.value === null ? 'Power of the drive: the mean is not yet known'
        : `The drive gives ${W.brief(power.value, power.error, 'W')}${power.error === null ? '; its error is not yet known' : ''}`);
      const line = (kind) => `<svg viewBox="0 0 32 12" aria-hidden="true"><path class="${kind}" d="M0 6H32" ${kind.startsWith('band') ? 'style="stroke:var(--link);stroke-width:10;opacity:.25"' : ''}/></svg>`;
      const legend = `<span>${line('mean')} mean</span><span>${line('band')} ± one standard error</span><span>${line('course')} in short windows</span>${frozen ? `<span>${line('mean ghost')} frozen</span>` : ''}`;
      if (this.legend !== legend) part('power-legend').innerHTML = this.legend = legend;
      this.#draw('power-chart', (width, height) => C.power(width, height, designs, this.axes.power),
        power.value === null ? 'Mean power of the sampled time; the thin line is the power in short windows.'
          : `Mean power over ${W.quantity(record.statistics.duration, 's')} of sampled time; the thin line is the power in short windows, of the run from its start.`);
    }

    #flow(record) {
      const flows = record.flows();
      if (!flows?.ins.length || !flows.outs.length) {
        write('flow-chart-title', 'Where the power goes: not yet known');
        return this.#draw('flow-chart', () => '', '');
      }
      const [first] = flows.outs, total = flows.ins.reduce((sum, row) => sum + row.value, 0);
      const name = (row) => (row.kept ? 'the balls' : row.kind ? `${W.kind(row.name)} contacts` : `motion ${row.name}`);
      write('flow-chart-title', first.kept ? `${W.share(first.value / total)} of ${W.quantity(total, 'W')} still accelerates the balls`
        : `${W.share(first.value / total)} of ${W.quantity(total, 'W')} is lost in ${name(first)}`);
      return this.#draw('flow-chart', (width, height) => C.flow(width, height, flows, record.mill.kinds),
        `In: ${flows.ins.map((row) => `${name(row)} ${W.quantity(row.value, 'W')}`).join(', ')}. Out: ${flows.outs.map((row) => `${name(row)} ${W.quantity(row.value, 'W')}`).join(', ')}. Mean over ${W.quantity(flows.time, 's')}.`);
    }

    #spectrum(record, frozen) {
      if (!record.begun || !record.spectrum) {
        write('spectrum-chart-title', 'How hard the balls hit: not yet known');
        return this.#draw('spectrum-chart', () => '', '');
      }
      const what = part('spectrum-what').value, each = part('spectrum-kinds').value === 'each';
      const there = record.mill.kinds.filter((kind) => record.spectrum.count[kind]?.some((value) => value > 0));
      const shown = each ? ['all', ...there] : ['all'];
      const designs = [record, frozen].filter((one) => one?.begun && one.spectrum).map((one) => ({ spectrum: one.spectrum, duration: one.statistics.duration, ghost: one !== record }));
      const half = R.halfAbove(record.spectrum), { rate } = record.hard(this.which), all = record.precise('rate.all');
      const share = rate.value === null || !all.value ? null : rate.value / all.value;
      write('spectrum-chart-title', half === null ? 'No impacts yet' : `Half of the energy lost is lost in impacts above ${W.quantity(half, 'J', 2)}`);
      const looks = C.looks(record.mill.kinds);
      const legend = shown.map((kind) => { const [colour, dashes] = looks[kind] ?? ['currentColor', '']; return `<span><svg viewBox="0 0 32 12" aria-hidden="true"><path class="curve" stroke="${colour}" stroke-dasharray="${dashes}" d="M0 6H32"/></svg> ${C.escape(kind === 'all' ? 'all' : W.kind(kind))}</span>`; }).join('')
        + (frozen ? '<span>dotted: frozen</span>' : '');
      if (this.kinds !== legend) part('spectrum-legend').innerHTML = this.kinds = legend;
      return this.#draw('spectrum-chart', (width, height) => C.spectrum(width, height, designs, { what, shown, threshold: record.threshold(this.which), kinds: record.mill.kinds, axes: this.axes.spectrum[what] ??= { x: {}, y: {} } }),
        share === null ? '' : `${sure(rate, '/s')} impacts have ${W.quantity(record.threshold(this.which), 'J')} or more (dashed line), ${W.share(share)} of all. Normal energy: half of the reduced mass times the square of the normal speed.`);
    }

    #balance(record) {
      const books = record.balance();
      const joule = (value) => W.minus(W.quantity(value, 'J', 4));
      write('balance-title', books ? `The books close to ${W.small(books.relative)} of the energy turned over` : 'Energy balance: not yet known');
      const rows = books ? [['total', 'Work of the drive', books.totals.work], ...books.work.map(([name, value]) => ['part', `motion ${name}`, value]),
        ['total', 'Lost in contacts', -books.totals.loss], ...books.loss.map(([name, value]) => ['part', `${W.kind(name)} contacts`, -value]),
        ['total', 'Stored in the balls', -books.totals.stored], ...books.stored.map(([name, value]) => ['part', `${name} energy`, -value]),
        ['over', 'Left over', books.over]] : [];
      const body = part('balance-rows');
      if (body.rows.length !== rows.length) body.replaceChildren(...rows.map(() => MillPanel.element('<template><tr><th scope="row"></th><td></td></tr></template>').content.firstElementChild));
      rows.forEach(([kind, name, value], k) => {
        const row = body.rows[k], text = kind === 'over' ? `${W.small(value)} J` : joule(value);
        row.className = kind;
        if (row.cells[0].textContent !== name) row.cells[0].textContent = name;
        if (row.cells[1].textContent !== text) row.cells[1].textContent = text;
      });
      write('balance-text', books ? `Since t = ${W.quantity(books.since, 's')}. Every contact's loss is computed from the speeds before and after it; the work, from the motions. Nothing is adjusted.` : '');
    }

    #compare(record, frozen) {
      part('compare').hidden = !frozen;
      if (!frozen) return;
      const rows = R.compare(record, frozen, this.which).map((row) => [row.name, sure(row.here, row.unit), sure(row.there, row.unit),
        row.error === null ? UNKNOWN : W.brief(row.apart, row.error, row.unit), row.words]);
      this.#cells('compare-rows', rows, (cells) => ({ better: 'agree', worse: 'differ', 'not yet known': 'open' }[cells[4]] ?? ''), [1, 2, 3]);
      const differ = R.differences(record.mill, frozen.mill);
      part('same-deck').hidden = differ.length > 0;
      part('keys-differ').hidden = !differ.length;
      this.#cells('differ-rows', differ, () => '', []);
    }

    #cells(id, rows, look, numbers) {
      const body = part(id);
      if (body.rows.length !== rows.length) {
        body.replaceChildren(...rows.map((row) => {
          const line = document.createElement('tr');
          row.forEach((_, k) => { const cell = line.appendChild(document.createElement(k ? 'td' : 'th')); if (!k) cell.scope = 'row'; if (numbers.includes(k)) cell.className = 'number'; });
          return line;
        }));
      }
      rows.forEach((cells, j) => cells.forEach((text, k) => {
        const cell = body.rows[j].cells[k];
        if (cell.textContent !== text) cell.textContent = text;
        if (k === cells.length - 1 && k > 2) cell.className = look(cells);
      }));
    }
  }

  return { Show, write };
})();
