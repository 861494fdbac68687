/* Numbers as text for readers, as milltools/base/text.py writes them. */
'use strict';

const MillWords = (() => {
  const PREFIXES = { '-4': 'p', '-3': 'n', '-2': 'µ', '-1': 'm', 0: '', 1: 'k', 2: 'M', 3: 'G', 4: 'T' };
  const COUNTS = { 1: 'thousand', 2: 'million', 3: 'billion', 4: 'trillion' };
  /** @type {[number, number, number, string][]} below how many seconds, the unit in seconds, decimals, the unit */
  const SPANS = [[120, 1, 0, 's'], [7200, 60, 0, 'min'], [360000, 3600, 1, 'h'], [Infinity, 86400, 1, 'days']];
  const SPACE = '\u00a0', THIN = '\u202f', MISSING = '\u2013';
  const minus = (text) => text.replaceAll('-', '\u2212');
  const raised = (exponent) => String(exponent).replace(/./g, (c) => ({ '-': '⁻' }[c] ?? '⁰¹²³⁴⁵⁶⁷⁸⁹'[c]));
  const exponentOf = (value, digits) => Number(Math.abs(value).toExponential(digits - 1).split('e')[1]);

  /** A number as text, such as 862, 0.0123 and 7.17×10⁶. */
  function number(value, digits = 3) {
    if (!Number.isFinite(value)) return '?';
    const exponent = value ? exponentOf(value, digits) : 0;
    if (exponent >= -3 && exponent < 4) return minus(String(Number(value.toPrecision(Math.max(digits, exponent + 1)))));
    return minus(`${Number((value / 10 ** exponent).toPrecision(digits))}×10${raised(exponent)}`);
  }

  /** Power of 1000 of the prefix that suits a value, and the text of unit and prefix. */
  function scale(value, unit, digits = 3) {
    const thousands = value && Number.isFinite(value) ? Math.min(Math.max(Math.floor(exponentOf(value, digits) / 3), -4), 4) : 0;
    if (unit === '') return { one: 1, tail: '' };
    const tail = unit === '/s' || unit === '/J' ? `${COUNTS[thousands] ? `${SPACE}${COUNTS[thousands]}` : ''}${unit}` : `${SPACE}${PREFIXES[thousands]}${unit}`;
    return unit.startsWith('/') && thousands < 0 ? { one: 1, tail: unit } : { one: 1000 ** thousands, tail };
  }

  /** A number with its unit and prefix, as in 862 W and 31.4 µW. */
  function quantity(value, unit, digits = 3) {
    if (!Number.isFinite(value)) return MISSING;
    const { one, tail } = scale(value, unit, digits);
    return number(value / one, digits) + tail;
  }

  /** Decimals of an error with one digit, or two if the first one is 1 or 2. */
  function decimals(error) {
    const [first, exponent] = error.toExponential(0).split('e');
    return Math.min(9, Math.max(0, Number('12'.includes(first)) - Number(exponent)));
  }

  /** With few digits: "862 ± 9 W"; without an error the value has three digits. */
  function brief(value, error, unit) {
    if (!Number.isFinite(value)) return MISSING;
    if (!(error > 0 && error < Infinity)) return quantity(value, unit);
    const { one, tail } = scale(Math.max(Math.abs(value), error), unit);
    const places = decimals(error / one);
    return minus(`${(value / one).toFixed(places)}${SPACE}±${SPACE}${(error / one).toFixed(places)}`) + tail;
  }

  /** 1.5e-15 -> "1.5 × 10⁻¹⁵". */
  function small(value) {
    if (!Number.isFinite(value)) return MISSING;
    if (value === 0) return '0';
    const [digits, exponent] = value.toExponential(1).split('e');
    return minus(digits) + `${THIN}×${THIN}10${raised(Number(exponent))}`;
  }

  /** 1795432 -> "1 795 432". */
  const count = (value) => String(Math.round(value)).replace(/\B(?=(\d{3})+$)/g, THIN);

  /** A share of 1 in per cent. */
  const share = (value) => `${number(100 * value, Math.abs(value) >= 0.1 ? 2 : 1)}${SPACE}%`;

  /** 42 s, 12 min, 3.5 h, 2.5 days. */
  function duration(seconds) {
    if (!Number.isFinite(seconds)) return '?';
    const [, size, digits, unit] = SPANS.find(([most]) => seconds < most);
    return `${(seconds / size).toFixed(digits)}${SPACE}${unit}`;
  }

  /** "ball_drum" -> "ball-drum". */
  const kind = (name) => name.replace('_', '-');

  return { number, quantity, brief, small, count, share, duration, kind, minus };
})();
