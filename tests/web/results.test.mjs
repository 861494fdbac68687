// What the studio makes of the messages of a source: numbers with errors, comparisons, figures; numbers as text
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { load, until } from './page.mjs';

const { MillWords: W, MillResults: R, MillCharts: C, FakeSource } = load(['MillWords', 'MillResults', 'MillCharts', 'FakeSource'],
  'studio/words.js', 'studio/deck.js', 'studio/results.js', 'studio/charts.js', 'tests/tools/fake_source.js');
const DECK = '[balls]\ncount = 30\n[rotor]\nspeed = 100 rpm\n';
const close = (a, b, most = 1e-12) => assert.ok(Math.abs(a - b) <= most * Math.abs(b), `${a}, not ${b}`);

/** What is known of the mill of a deck after some times [s]. */
async function recorded(deck, ...times) {
  const source = new FakeSource(new Uint8Array(768));
  let record;
  source.on = (message) => ({ mill: () => { record = new R.Record({ ...message, text: deck }); }, state: () => record.see(message), results: () => record.learn(message) })[message.type]();
  source.load(deck);
  await until(() => record?.state);
  for (const time of times) source.advance(time - source.time);
  return record;
}

test('the power has its error when there is one', async () => {
  const early = await recorded(DECK, 0.25), late = await recorded(DECK, 0.25, 4);
  assert.deepEqual([early.power(), late.power()], [{ value: 100, error: null }, { value: 100, error: 1 }]);
  assert.deepEqual(late.means.map(({ time, error }) => [time, error]), [[0.25, null], [4, 1]]);
  assert.deepEqual((await recorded(DECK)).power(), { value: null, error: null });
});

test('where the power goes, and the balance of the energies since the start', async () => {
  const record = await recorded(DECK, 4), { ins, outs, time } = record.flows(), books = record.balance();
  assert.deepEqual([time, ins, outs.map(({ name, value }) => [name, Math.round(value)])],
    [4, [{ name: 'rotor', value: 100 }], [['ball_ball', 70], ['ball_drum', 30]]]);
  record.statistics.motions.rotor.power = 120;
  assert.deepEqual(record.flows().outs[2], { name: 'the balls', kept: true, value: 20 });
  assert.deepEqual([books.totals.work, books.loss, books.stored.map(([, value]) => value)], [400, [['ball_ball', 280], ['ball_drum', 120]], [0, 0, 0]]);
  close(books.over, 4e-13);
  close(books.relative, 5e-16);
});

test('powers in short windows are those of the work, wherever its points are', async () => {
  const powers = (await recorded(DECK, 0.1, 0.15, 0.3, 0.9, 1, 1.7, 2)).powers(4);
  assert.deepEqual(powers.map(([time]) => time), [0.25, 0.75, 1.25, 1.75]);
  for (const [, value] of powers) close(value, 100);
});

test('hard impacts: the errors are those of the engine, else of the scatter of the run', async () => {
  const record = await recorded(DECK, ...Array.from({ length: 40 }, (_, k) => (k + 1) / 10));
  assert.deepEqual(record.hard(3), { rate: { value: 5000, error: 100 }, perJoule: { value: 50, error: 1 } });
  const { rate, perJoule } = record.hard(0), { edges, count } = record.spectrum;
  const counted = count.all.reduce((sum, n, k) => sum + (edges[k] >= 0.999e-4 ? n : 0), 0);
  close(rate.value, counted / 4, 1e-9);
  assert.ok(rate.error >= 0 && rate.error < 0.01 * rate.value);
  close(perJoule.value, rate.value / 100);
  let all = 0; // at rates of 1 and 3 in turns
  record.tails = Array.from({ length: 33 }, (_, k) => ({ time: k, counts: [k ? (all += (k - 1) & 2 ? 3 : 1) : 0] }));
  const uneven = record.hard(0);
  close(uneven.rate.error, (2.131 / 1.96) * Math.sqrt(1 / 15));
  close(uneven.perJoule.error, uneven.perJoule.value * Math.hypot(uneven.rate.error / uneven.rate.value, 0.01));
  const few = await recorded(DECK, 1, 2, 3);
  assert.equal(few.hard(2).rate.error, null);
});

test('a part of a bin counts by its share of the logarithm; half of the loss is above an energy', () => {
  const spectrum = { edges: [1e-3, 1e-2, 1e-1, 1], count: { all: [8, 4, 2] }, dissipation: { all: [1, 2, 3] } };
  for (const [energy, wanted] of [[1e-3, 14], [10 ** -1.5, 4], [1e-1, 2], [1, 0]]) close(R.above(spectrum, energy), wanted, 1e-9);
  assert.deepEqual([R.halfAbove(spectrum), R.halfAbove({ edges: [0, 1], dissipation: { all: [0] } })], [1e-1, null]);
  close(R.halfAbove({ ...spectrum, dissipation: { all: [1, 2, 4] } }), 10 ** -0.875); // an eighth of the bin's loss is below
});

test('two designs are told apart beyond 1.96 standard errors of their difference', async () => {
  const slow = await recorded(DECK, 4), fast = await recorded(DECK.replace('100', '150'), 4);
  const rows = Object.fromEntries(R.compare(fast, slow, 3).map((row) => [row.name, row]));
  assert.deepEqual(rows['Power of the drive'], { name: 'Power of the drive', unit: 'W', here: { value: 150, error: 1.5 }, there: { value: 100, error: 1 }, apart: 50, error: Math.hypot(1.5, 1), words: 'more' });
  assert.deepEqual(Object.values(rows).map((row) => row.words), ['more', 'better', 'cannot be told apart', 'cannot be told apart', 'cannot be told apart']);
  assert.deepEqual(new Set(R.compare(slow, slow.frozen(), 3).map((row) => row.words)), new Set(['cannot be told apart']));
  assert.deepEqual(R.differences(fast.mill, slow.mill), [['rotor.speed', '150 rpm', '100 rpm']]);
  const at = (apart, good) => R.verdict({ value: 10 + apart, error: 3 }, { value: 10, error: 4 }, good).words;
  assert.deepEqual([at(9.7, 1), at(9.9, 1), at(-9.9, 1), at(-9.9, -1), at(-9.9, 0)], ['cannot be told apart', 'better', 'worse', 'better', 'less']);
  assert.equal(R.verdict({ value: 9, error: null }, { value: 1, error: 1 }, 1).words, 'not yet known');
});

test('what is frozen no longer grows', async () => {
  const record = await recorded(DECK, 1), frozen = record.frozen();
  record.learn({ statistics: { ...record.statistics, drive: { power: 7, power_error: 1 } } });
  record.see({ ...record.state, time: 9 });
  assert.deepEqual([frozen.work.length, frozen.means.length, frozen.state.time, frozen.power().value], [2, 1, 1, 100]);
});

test('figures have axes with units', async () => {
  const record = await recorded(DECK, 0.5, 1, 2, 4), axes = () => ({ x: new C.Axis(), y: new C.Axis() });
  const { spectrum, statistics: { duration }, mill: { kinds }, means } = record;
  const labels = (svg) => [...svg.matchAll(/class="label"[^>]*>([^<]*)/g)].map(([, text]) => text);
  const drawn = C.power(520, 260, [{ means, course: record.powers() }, { means, course: [], ghost: true }], axes());
  assert.deepEqual(labels(drawn), ['simulated time [s]', 'power of the drive [W]']);
  assert.equal(drawn.match(/class="(mean|band|course)/g).length, 5);
  const energies = (what) => C.spectrum(520, 260, [{ spectrum, duration }], { what, shown: ['all', ...kinds], threshold: 1e-3, kinds, axes: { x: {}, y: {} } });
  assert.deepEqual([...labels(energies('count')), ...labels(energies('dissipation'))],
    ['normal energy of an impact [J]', 'impacts [1/(s decade)]', 'normal energy of an impact [J]', 'power lost [W/decade]']);
  assert.equal(energies('count').match(/class="curve/g).length, 3);
  const flow = C.flow(520, 260, record.flows(), kinds);
  assert.match(flow, /ball-ball contacts<.*70\u00a0W, 70\u00a0%/);
  assert.doesNotMatch(drawn + flow, /NaN|undefined/);
});

test('an axis keeps its ends until the data leave it', () => {
  const axis = new C.Axis(), ends = ({ low, high }) => [low, high];
  assert.deepEqual(ends(axis.fit(0, 4)), [0, 5]);
  assert.deepEqual(ends(axis.fit(1, 4.9)), [0, 5]);
  assert.deepEqual(ends(axis.fit(1, 6)), [0, 7.25]);
  assert.deepEqual(ends(axis.fit(1, 2)), [0.75, 2.25]);
});

test('a density has the number of the impacts as its area, in about ten points a decade', () => {
  const edges = Array.from({ length: 201 }, (_, k) => 10 ** (k / 50)), points = C.density(edges, Array(200).fill(5), 2);
  assert.equal(points.length, 40);
  close(points.reduce((sum, [, value]) => sum + 0.1 * value, 0), 500, 1e-9);
});

test('numbers as text', () => {
  const N = '\u00a0', said = [
    [W.quantity(862.48, 'W'), `862${N}W`], [W.quantity(3.14e-5, 'W'), `31.4${N}µW`], [W.quantity(7.17e6, '/s'), `7.17${N}million/s`],
    [W.quantity(0.0123, '/J'), '0.0123/J'], [W.quantity(NaN, 'W'), '–'], [W.brief(862.48, 8.75, 'W'), `862${N}±${N}9${N}W`],
    [W.brief(5, 0.213, 'W'), `5.00${N}±${N}0.21${N}W`], [W.brief(-12.34, 0.126, 'mJ'.slice(1)), `\u221212.34${N}±${N}0.13${N}J`], [W.brief(5, null, 'W'), `5${N}W`],
    [W.small(1.5e-15), '1.5\u202f×\u202f10⁻¹⁵'], [W.small(0), '0'], [W.count(1795432.4), '1\u202f795\u202f432'], [W.share(0.1234), `12${N}%`], [W.share(0.0123), `1${N}%`],
    [W.duration(42), `42${N}s`], [W.duration(300), `5${N}min`], [W.duration(12600), `3.5${N}h`], [W.duration(864000), `10.0${N}days`], [W.duration(Infinity), '?'],
    [W.number(0), '0'], [W.number(7.17e6), '7.17×10⁶'], [W.number(12345), '1.23×10⁴'], [W.number(99999), '1×10⁵'], [W.kind('ball_drum'), 'ball-drum'],
  ];
  for (const [found, wanted] of said) assert.equal(found, wanted);
});
