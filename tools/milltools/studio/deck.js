/* The deck as text: reads and sets values, and packs a deck into a link. Only the engine knows what a deck means; here
   it is lines. Comments, the order of keys and the units of values stay as they are. */
'use strict';

const MillDeck = (() => {
  // [SI unit, {unit: SI in one of it}, the unit of the fields unless the deck has another of these]
  /** @type {[string, Record<string, number>, string][]} */
  const DIMENSIONS = [
    ['m', { mm: 1e-3, cm: 1e-2, m: 1, um: 1e-6, inch: 0.0254 }, 'mm'],
    ['rad/s', { rpm: Math.PI / 30, '1/min': Math.PI / 30, 'rad/s': 1, 'deg/s': Math.PI / 180 }, 'rpm'],
    ['Hz', { Hz: 1, '1/s': 1, '1/min': 1 / 60 }, 'Hz'],
    ['rad', { deg: Math.PI / 180, rad: 1 }, 'deg'],
    ['s', { s: 1, ms: 1e-3, us: 1e-6 }, 's'],
    ['kg', { kg: 1, g: 1e-3 }, 'g'],
    ['m/s', { 'm/s': 1, 'mm/s': 1e-3 }, 'm/s'],
    ['1', { '%': 0.01, '': 1 }, '%'],
  ];
  const LINE = /^(\s*)([^=#;[\s][^=]*?)(\s*=\s*)(.*)$/;

  /** [value without comment and white space, the rest of the line] of what follows "=". */
  function parted(text) {
    const quoted = /^"(?:[^"]|"")*"/.exec(text);
    const end = quoted ? quoted[0].length : (/(^|\s+)[#;]|\s*$/.exec(text)?.index ?? text.length);
    return [text.slice(0, end), text.slice(end)];
  }

  /** The lines of a deck as [{section, key, at}]; key undefined: the title of the section. */
  function places(lines) {
    const found = [];
    let section;
    lines.forEach((line, at) => {
      const title = /^\s*\[([^\]]*)\]/.exec(line), entry = LINE.exec(line);
      if (title) found.push({ section: section = title[1].trim(), at });
      else if (entry && section !== undefined) found.push({ section, key: entry[2].trim(), at });
    });
    return found;
  }

  /** Map "section.key" -> value as in the text. Names of sections may have points, keys have none. */
  function values(text) {
    const lines = text.split(/\r?\n/);
    return new Map(places(lines).filter((one) => one.key !== undefined)
      .map(({ section, key, at }) => [`${section}.${key}`, parted(LINE.exec(lines[at])[4])[0].trim()]));
  }

  const get = (text, section, key) => values(text).get(`${section}.${key}`);

  /** The deck with a key set to a value (text with its unit). `instead`: keys of which the deck has one at most; the
      value then takes the line of the one that is there. A new key goes to the end of its section. */
  function set(text, section, key, value, instead = []) {
    const lines = text.split(/\r?\n/), there = places(lines).filter((one) => one.section === section);
    const old = there.find((one) => one.key === key) ?? there.find((one) => instead.includes(one.key));
    if (old) {
      const [, lead, , equals, rest] = LINE.exec(lines[old.at]);
      const [before, comment] = parted(rest);
      const room = comment.trim() ? comment.replace(/^\s*/, (gap) => ' '.repeat(Math.max(1, gap.length + before.length - value.length))) : '';
      lines[old.at] = `${lead}${key}${equals}${value}${room}`;
    } else if (there.length) {
      lines.splice(there[there.length - 1].at + 1, 0, `${key} = ${value}`);
    } else {
      while (lines.length && !lines[lines.length - 1].trim()) lines.pop();
      lines.push('', `[${section}]`, `${key} = ${value}`, '');
    }
    return lines.join('\n');
  }

  /** The deck without a key. */
  function remove(text, section, key) {
    const lines = text.split(/\r?\n/), gone = places(lines).find((one) => one.section === section && one.key === key);
    return lines.filter((_, at) => at !== gone?.at).join('\n');
  }

  /** The numbers and the unit of a value: "0 0 4.5 mm" -> {numbers: [0, 0, 4.5], unit: 'mm'}. */
  function measured(value) {
    const words = value.trim().split(/\s+/), numbers = [];
    while (words.length && words[0] !== '' && Number.isFinite(Number(words[0]))) numbers.push(Number(words.shift()));
    const glued = !numbers.length && /^([-+]?[\d.]+(?:e[-+]?\d+)?)(\D.*)$/i.exec(words.join(' ')); // "75mm"
    return glued ? { numbers: [Number(glued[1])], unit: glued[2].trim() } : { numbers, unit: words.join(' ') };
  }

  /** The unit for a value of an SI unit: that of its text if it is a usual one, else the usual one. Returns
      {name, size}: SI units in one of it. */
  function unit(si, text) {
    const found = DIMENSIONS.find(([name]) => name === si);
    if (!found) return { name: si, size: 1 };
    const own = text === undefined ? undefined : measured(text).unit;
    const name = own !== undefined && own in found[1] ? own : found[2];
    return { name, size: found[1][name] };
  }

  /** A number of a deck, without digits that only rounding made. */
  const digits = (value) => String(Number(value.toPrecision(7)));

  /** Eight hexadecimal digits that tell texts apart (FNV-1a). */
  function mark(text) {
    let hash = 0x811c9dc5;
    for (const byte of new TextEncoder().encode(text)) hash = Math.imul(hash ^ byte, 0x01000193);
    return (hash >>> 0).toString(16).padStart(8, '0');
  }

  /** {set: {"section.key": value}, gone: ["section.key"]}: what makes a deck of another; null if lines of it are no
      keys and values alone. */
  function difference(from, to) {
    const before = values(from), after = values(to);
    return {
      set: Object.fromEntries([...after].filter(([name, value]) => before.get(name) !== value)),
      gone: [...before.keys()].filter((name) => !after.has(name)),
    };
  }

  const split = (name) => [name.slice(0, name.lastIndexOf('.')), name.slice(name.lastIndexOf('.') + 1)];

  function changed(text, { set: some, gone = [] }) {
    for (const name of gone) text = remove(text, ...split(name));
    for (const [name, value] of Object.entries(some)) text = set(text, ...split(name), value);
    return text;
  }

  async function through(stream, bytes) {
    return new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(stream)).arrayBuffer());
  }

  const base64url = (bytes) => btoa(Array.from(bytes, (b) => String.fromCharCode(b)).join(''))
    .replaceAll('+', '-').replaceAll('/', '_').replace(/=+$/, '');
  const bytesOf = (text) => Uint8Array.from(atob(text.replaceAll('-', '+').replaceAll('_', '/')), (c) => c.charCodeAt(0));

  /** Promise of a deck as text for a link: its differences from a preset {name, text} if there is one, else all of it. */
  async function pack(text, preset) {
    /** @type {object} */
    let what = { deck: text };
    if (preset) {
      const changes = difference(preset.text, text);
      const same = Object.keys(changes.set).length + changes.gone.length < 40;
      if (same) what = { preset: preset.name, mark: mark(preset.text), ...changes };
    }
    return base64url(await through(new CompressionStream('deflate-raw'), new TextEncoder().encode(JSON.stringify(what))));
  }

  /** Promise of {text, preset (its name, or undefined), remark} of pack()'s text; `presets`: [{name, text}]. */
  async function unpack(packed, presets) {
    let what;
    try {
      what = JSON.parse(new TextDecoder().decode(await through(new DecompressionStream('deflate-raw'), bytesOf(packed))));
    } catch {
      throw new Error('The design in the link is damaged: ask for the whole link, or open a deck.');
    }
    if (typeof what?.deck === 'string') return { text: what.deck };
    const preset = presets.find((one) => one.name === what?.preset);
    if (!preset) throw new Error(`The link changes the deck "${what?.preset}", which this page does not have: ask for the deck itself.`);
    const remark = what.mark === mark(preset.text) ? ''
      : `The link was made with another version of ${preset.name}.ini: values that it does not set may differ.`;
    return { text: changed(preset.text, what), preset: preset.name, remark };
  }

  return { values, get, set, remove, measured, unit, digits, difference, pack, unpack };
})();
