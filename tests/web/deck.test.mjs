// The deck as text, its sliders, and links that hold a design
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { load, ROOT } from './page.mjs';

const { MillDeck, MillControls, FakeSource } = load(['MillDeck', 'MillControls', 'FakeSource'],
  'studio/deck.js', 'studio/controls.js', 'tests/tools/fake_source.js');
const input = (name) => readFileSync(new URL(`input/${name}.ini`, ROOT), 'utf8');
const PRESETS = ['simoloyer', 'wavy'].map((name) => ({ name, text: input(name) }));
const choose = (deck) => MillControls.choose(deck, FakeSource.prototype.keys(deck));

test('a value is set and all else stays as it is', () => {
  const text = '[a.b]\nx = 75 mm   # the radius\nfile = "a #b.stl" ; hm\n[c]\ny=3\n', fill = '[balls]\nfill = 20 %  # much\n';
  assert.equal(MillDeck.set(text, 'a.b', 'x', '100 mm'), text.replace('75 mm   #', '100 mm  #'));
  assert.equal(MillDeck.set(text, 'a.b', 'file', 'c.stl'), text.replace('"a #b.stl" ;', 'c.stl      ;'));
  assert.equal(MillDeck.set(text, 'a.b', 'z', '1'), text.replace('[c]', 'z = 1\n[c]'));
  assert.equal(MillDeck.set(text, 'd', 'z', '1'), `${text}\n[d]\nz = 1\n`);
  assert.equal(MillDeck.set(fill, 'balls', 'count', '7', ['fill']), '[balls]\ncount = 7     # much\n');
  assert.equal(MillDeck.get(text, 'a.b', 'file'), '"a #b.stl"');
});

test('sliders take bounds, units and meanings from the keys, and go around the value', () => {
  const found = choose('[balls]\ncount = 30\ndiameter = 5 mm # small\n[contact]\nrestitution = 0.8\nfriction = 0.3\n[rotor]\nspeed = 100 rpm\n');
  assert.deepEqual(found.map(({ label, unit, value, lo, hi, from, to, step }) => [label, unit, value, lo, Math.round(10 * hi) / 10, from, to, step]), [
    ['Speed of the rotor', 'rpm', 100, -1e9 / (Math.PI / 30), Math.round(10e9 / (Math.PI / 30)) / 10, 10, 200, 2],
    ['Balls', '', 30, 1, 123456, 1, 60, 1],
    ['Ball diameter', 'mm', 5, 1, 7.7, 2.5, 7.7, 0.05],
    ['Restitution', '', 0.8, 0, 1, 0, 1, 0.01],
    ['Friction', '', 0.3, 0, 10, 0, 1, 0.01],
  ]);
  assert.deepEqual(MillDeck.unit('Hz', '90 1/min'), { name: '1/min', size: 1 / 60 });
  assert.equal(found[2].meaning, 'the meaning of diameter');
  assert.equal(found[2].set('[balls]\ndiameter = 5 mm # small\n', 6.5), '[balls]\ndiameter = 6.5 mm # small\n');
});

test('a share of the critical speed stays one, and classes of sizes have no sliders', () => {
  const deck = '[motion.roll]\nkind = turn\nspeed = -70 % critical # fast\n[balls]\nsizes = bond\ndiameter = 9 mm\n';
  const keys = [['motion.roll', 'speed', '-5.6 rad/s', 'rad/s'], ['balls.balls_1', 'diameter', '0.007 m', 'm']]
    .map(([section, key, value, unit]) => ({ section, key, value, unit, type: 'number', lo: -1e9, hi: 1e9, above: 0, words: '', meaning: '', instead: '' }));
  const [roll, ...others] = MillControls.choose(deck, keys);
  assert.deepEqual([roll.label, roll.unit, roll.value, roll.from, roll.to, others], ['Speed of roll', '% critical', -70, -140, -7, []]);
  assert.match(roll.set(deck, -80), /speed = -80 % critical # fast/);
});

test('the keys of lifters have sliders where a deck has them', () => {
  const deck = '[drum]\nprofile = lifters\nlifters = 8\nlifter_front = 20 deg\n';
  const keys = [['lifters', '8', '', 'whole', 1], ['lifter_front', '0.349 rad', 'rad', 'number', 0]]
    .map(([key, value, unit, type, lo]) => ({ section: 'drum', key, value, unit, type, lo, hi: 500, above: 0, words: '', meaning: '', instead: '' }));
  const found = MillControls.choose(deck, keys);
  assert.deepEqual(found.map((one) => [one.label, one.value, one.from, one.to]), [['Lifters', 8, 1, 20], ['Lifter front', 20, 0, 40]]);
  assert.match(found[1].set(deck, 30), /lifter_front = 30 deg/);
});

test('the ratio of a jar is kept when the speed of its disk is changed', () => {
  const deck = input('planetary'), [sun, jar] = choose(deck), speeds = (text) => text.match(/speed = \S+/g);
  assert.deepEqual([sun.label, jar.label, jar.value], ['Speed of sun', 'Speed ratio jar : sun', -2]);
  assert.deepEqual(speeds(sun.set(deck, 500)), ['speed = 500', 'speed = -1000']);
  assert.deepEqual(speeds(jar.set(deck, -1.5)), ['speed = 650', 'speed = -975']);
});

test('a link holds a design: what differs from a preset, or all of it', async () => {
  const [preset] = PRESETS, changed = MillDeck.set(preset.text, 'balls', 'count', '55'), own = '[balls]\ncount = 55 # own\n';
  const short = await MillDeck.pack(changed, preset), whole = await MillDeck.pack(own);
  assert.ok(short.length < 120 && whole.length < 400 && /^[\w-]+$/.test(short + whole));
  assert.deepEqual(await MillDeck.unpack(short, PRESETS), { text: changed, preset: 'simoloyer', remark: '' });
  assert.deepEqual(await MillDeck.unpack(whole, PRESETS), { text: own });
  const later = [{ name: 'simoloyer', text: `${preset.text}# new\n` }];
  assert.match((await MillDeck.unpack(short, later)).remark, /another version of simoloyer.ini/);
  await assert.rejects(MillDeck.unpack(short, []), /"simoloyer", which this page does not have/);
  for (const damaged of ['abcdef', short.slice(0, -9), '%', '']) await assert.rejects(MillDeck.unpack(damaged, PRESETS), /is damaged/);
});
