/* The design at the side of the page: sliders with number fields, and all keys of the deck as a table. */
'use strict';

const MillPanel = (() => {
  const { escape } = MillCharts;

  /** @returns {any} */
  function element(markup) {
    const place = document.createElement('template');
    place.innerHTML = markup.trim();
    return place.content.firstElementChild;
  }

  class Panel {
    sliders; table; faults; change; // as the constructor says
    live = true; // fields can be changed
    rows = new Map(); fields = new Map();

    /** `parts`: {sliders, table, faults} elements; change(make, id): make is a function that changes a deck's text. */
    constructor(parts, change) {
      Object.assign(this, { ...parts, change });
    }

    /** Shows a deck: its text, and the engine's keys. What has the focus keeps it. The file of a run has its deck in SI:
        its fields have usual units. */
    show(text, keys) {
      const controls = MillControls.choose(this.live ? text : '', keys), names = controls.map((one) => `${one.id} ${one.unit}`).join();
      if (names !== this.names) {
        this.names = names;
        this.rows = new Map(controls.map((one) => [one.id, this.#row(one)]));
        this.sliders.replaceChildren(...[...this.rows.values()].map(({ box }) => box));
      }
      for (const one of controls) this.#fill(this.rows.get(one.id), one);
      this.#table(text, keys);
      this.fault([]);
    }

    #row(control) {
      const id = `c-${control.id.replace(/[^\w]/g, '-')}`;
      const box = element(`<div class="control"><label for="${id}">${escape(control.label)}</label>
        <span class="field"><input type="number" id="${id}" step="any" aria-describedby="${id}-fault"><span class="unit">${escape(control.unit)}</span></span>
        <input type="range" aria-label="${escape(control.label)}"><p class="fault" id="${id}-fault" role="alert" hidden></p></div>`);
      const [field, range] = box.querySelectorAll('input'), row = { box, field, range, fault: box.querySelector('.fault'), control: undefined };
      const set = (value) => this.change((text) => row.control.set(text, value), control.id);
      range.addEventListener('input', () => { field.value = range.value; this.#tell(row); set(Number(range.value)); });
      field.addEventListener('input', () => {
        const given = Number.isFinite(field.valueAsNumber);
        this.#complain([row], given ? '' : `a number is expected; the mill has ${row.control.value} ${row.control.unit}`.trim());
        if (!given) return;
        range.value = field.value;
        this.#tell(row);
        set(field.valueAsNumber);
      });
      return row;
    }

    #tell({ range, field, control }) { range.setAttribute('aria-valuetext', `${field.value} ${control.unit}`.trim()); }

    /** Fills in a row. The range of its slider stays as long as the value is within it. */
    #fill(row, control) {
      const { field, range, box } = row, busy = document.activeElement === field || document.activeElement === range;
      const kept = row.control && control.value >= row.control.from && control.value <= row.control.to && row.control.lo === control.lo;
      row.control = kept ? { ...control, from: row.control.from, to: row.control.to, step: row.control.step } : control;
      const { lo, hi, above, from, to, step, value } = row.control;
      for (const [name, limit] of [['min', lo], ['max', hi]]) limit === null ? field.removeAttribute(name) : field.setAttribute(name, limit);
      Object.assign(range, { min: from, max: to, step });
      box.title = `${control.meaning}${lo === null && hi === null ? '' : ` (${above ? 'above' : 'from'} ${lo ?? '−∞'} to ${hi ?? '∞'}${control.unit && ` ${control.unit}`})`}`;
      if (!busy || Number(field.value) !== value) {
        if (document.activeElement !== field) field.value = value;
        range.value = value;
      }
      field.readOnly = range.disabled = !this.live;
      this.#tell(row);
    }

    /** The table of all keys: built anew when other keys are there. */
    #table(text, keys) {
      const names = keys.map((key) => `${key.section}.${key.key}`).join();
      if (names !== this.keys) {
        this.keys = names;
        const inside = [];
        let section;
        this.fields = new Map();
        for (const key of keys) {
          if (key.value === '' && MillDeck.get(text, key.section, key.key) === undefined) continue; // another way to give one that is there
          if (key.section !== section) inside.push(element(`<h3>[${escape(section = key.section)}]</h3>`));
          inside.push(this.#key(key));
        }
        this.table.replaceChildren(...inside);
      }
      for (const [name, { field, fault }] of this.fields) {
        const key = keys.find((one) => `${one.section}.${one.key}` === name), given = MillDeck.get(text, key.section, key.key);
        if (document.activeElement !== field) field.value = given ?? key.value;
        field.classList.toggle('default', given === undefined);
        field[field.tagName === 'SELECT' ? 'disabled' : 'readOnly'] = !this.live;
        fault.hidden = true;
      }
    }

    #key(key) {
      const name = `${key.section}.${key.key}`, id = `k-${name.replace(/[^\w]/g, '-')}`;
      const choice = key.type === 'choice' && `<select class="key-value" id="${id}" aria-describedby="${id}-what">${key.words.split('|').map((word) => `<option>${escape(word)}</option>`).join('')}</select>`;
      const row = element(`<div class="key-row"><label for="${id}">${escape(key.key)}</label>${choice || `<input class="key-value" id="${id}" aria-describedby="${id}-what" spellcheck="false" autocomplete="off">`}
        <small id="${id}-what">${escape(key.meaning)}</small><p class="fault" role="alert" hidden></p></div>`);
      const field = row.querySelector('.key-value');
      field.addEventListener('change', () => this.change((text) => MillDeck.set(text, key.section, key.key, field.value.trim(), MillControls.INSTEAD[key.key]), name));
      this.fields.set(name, { field, fault: row.querySelector('.fault') });
      return row;
    }

    #complain(places, text) {
      for (const { field, fault } of places) {
        fault.textContent = text;
        fault.hidden = !text;
        field.setAttribute('aria-invalid', String(Boolean(text)));
      }
    }

    /** Shows messages of the engine beside the fields that they name, else beside the one that caused them (`id`), else
        above all. No lines: there are none any more. */
    fault(lines, id) {
      const places = new Map([...this.fields].map(([name, one]) => [name, [one]]));
      for (const [name, row] of this.rows) {
        const own = name.split('/')[0];
        places.set(own, [row, ...(places.get(own) ?? [])]);
      }
      const said = new Map(), rest = [];
      for (const line of lines) {
        const [, section, key, words] = /\[([^\]]+)\] (\w+): (.*)$/s.exec(line) ?? [];
        const named = places.has(`${section}.${key}`) ? `${section}.${key}` : places.has(id?.split('/')[0]) ? id.split('/')[0] : null;
        const whole = line.replace(/^deck(:\d+)?: /, '');
        if (named) said.set(named, [...(said.get(named) ?? []), named === `${section}.${key}` ? words : whole]);
        else rest.push(whole);
      }
      for (const [name, all] of places) {
        this.#complain(all, (said.get(name) ?? []).join('\n'));
      }
      this.faults.textContent = rest.join('\n');
      this.faults.hidden = !rest.length;
    }
  }

  return { Panel, element };
})();
