// The engine of the studio: the same mill, with the same bits, as the program on this computer
import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, test } from 'node:test';
import { load, ROOT } from './page.mjs';

const { MillEngine, MillResults: R } = load(['MillEngine', 'MillResults'], 'studio/engine.js', 'studio/results.js');
const engine = await MillEngine.start(readFileSync(new URL('build/wasm/millsim.wasm', ROOT)));
const folder = mkdtempSync(join(tmpdir(), 'mill-'));
after(() => rmSync(folder, { recursive: true }));
const PROGRAM = process.env.MILLSIM ?? new URL('millsim', ROOT).pathname;
const text = (name) => readFileSync(new URL(`input/${name}.ini`, ROOT), 'utf8');
const STL = new Uint8Array(readFileSync(new URL('input/rotor.stl', ROOT)));
const SMALL = /SMALL = """\\\n(.*?)"""/s.exec(readFileSync(new URL('tests/conftest.py', ROOT), 'utf8'))[1];

/** What the program says of the run of a deck. */
function native(deck, set) {
  writeFileSync(join(folder, 'deck.ini'), deck);
  writeFileSync(join(folder, 'rotor.stl'), STL);
  const words = [...set.flatMap((one) => ['-s', one]), '-j', '-q', '-f', '-o', 'run.h5', 'deck.ini'];
  return JSON.parse(execFileSync(PROGRAM, words, { cwd: folder, encoding: 'utf8', stdio: ['ignore', 'pipe', 'ignore'] }));
}

/** What the engine says of it; `slices`: of so many events before it goes on to the end. */
function run(deck, until, set = [], { files = new Map(), slices = 0 } = {}) {
  const mill = engine.load(deck, set, files);
  for (let k = 0; k < slices; k++) engine.run(until, 1000 + 777 * k);
  engine.run(until, 1e15);
  return { mill, ...engine.state(), ...engine.results() };
}

/** The messages for a deck that is refused. */
function refused(...words) {
  try {
    run(...words);
  } catch (fault) {
    return fault.lines;
  }
  return assert.fail('it was not refused');
}

function sameBits(name, until, set, files) {
  const deck = text(name), told = native(deck, [...set, 'run.starts=1']), found = run(deck, until, set, { files });
  assert.deepEqual(found.statistics, told.statistics);
  assert.deepEqual([found.contacts, found.work], [Object.values(told.run.collisions).reduce((a, b) => a + b), told.run.drive_work]);
  assert.ok(Math.abs(found.balance.error) < 1e-12 * found.balance.turnover); // the books close
  return found;
}

test('after half a million contacts the reference mill has the bits of the program', () => {
  assert.ok(sameBits('simoloyer', 0.1, ['run.time=0.1 s', 'run.sample_from=0.05 s']).contacts > 5e5);
});

for (const [name, time, ...more] of [
  ['planetary', 1, 'balls.count=50', 'balls.diameter=8 mm'], ['mixer', 1], ['attritor', 0.1, 'run.sample_from=0.05 s'],
  ['tumbling', 1, 'run.sample_from=0.5 s'], ['stl', 0.05, 'run.sample_from=0 s'], ['wavy', 0.05, 'run.precision=0', 'run.sample_from=0.02 s'],
  ['shaker', 0.5, 'run.sample_from=0.1 s'], ['emax', 0.2, 'run.sample_from=0.05 s'], ['discs', 0.01, 'run.sample_from=0 s'], ['ballmill', 0.1, 'run.sample_from=0 s'], ['mixture', 0.02, 'run.sample_from=0 s'],
]) test(`${name} has the bits of the program`, () => { sameBits(name, time, [`run.time=${time} s`, ...more], new Map([['rotor.stl', STL]])); });

test('the power of a planetary mill is that of the program, and goes where it is lost', () => {
  const record = new R.Record(engine.load(text('planetary'), ['run.time=10000 s', 'output.series=1 s']));
  record.see(engine.state());
  while (!(record.power().error > 0 && record.power().error < 0.3)) {
    engine.run(Infinity, 20000);
    record.see(engine.state());
    record.learn(engine.results());
  }
  const { value, error } = record.power(), { ins, outs } = record.flows(), total = (rows) => rows.reduce((sum, row) => sum + row.value, 0);
  assert.ok(Math.abs(value - 15.70) < 4 * error, `${value} +- ${error}`); // [W] of `millsim input/planetary.ini`: 15.70 +- 0.05
  assert.ok(Math.abs(total(outs) / total(ins) - 1) < 0.01);
  const { statistics, spectrum, mill: { kinds } } = record, counted = R.above(spectrum, statistics.hard_energy) / statistics.duration;
  assert.ok(Math.abs(counted / statistics.precision.hard_rate.value - 1) < 1e-6);
  assert.deepEqual(kinds.map((kind) => spectrum.count[kind].reduce((a, b) => a + b)), kinds.map((kind) => statistics.impacts[kind].count));
});

test('a run ends when its results are as precise as the deck asks', () => {
  engine.load(text('planetary'), ['run.precision=20 %', 'run.time=100 s']);
  let ended = false;
  for (let time = 0.25; time < 20 && !ended; time += 0.25) {
    ended = engine.run(time, 1e7);
    engine.results();
  }
  assert.ok(ended && engine.state().time < 20);
});

test('the notes are those of the summary', () => {
  const soft = ['contact.restitution=0.4'], { notes } = native(SMALL, soft);
  assert.ok(notes.some((note) => note.includes('hard spheres have been compared')));
  assert.deepEqual(run(SMALL, 0.05, soft).notes, notes);
});

test('pauses change nothing', () => {
  const [whole, paused] = [0, 40].map((slices) => run(SMALL, 0.05, [], { slices }));
  assert.deepEqual([paused.statistics, paused.work], [whole.statistics, whole.work]);
});

test("a wrong deck gets the program's own messages, and the mill before it goes on", () => {
  const wrong = SMALL.replace('radius = 30 mm', 'radius = 30 s').replace('count = 20', 'count = many'), before = run(SMALL, 0.02);
  writeFileSync(join(folder, 'deck.ini'), wrong);
  const said = spawnSync(PROGRAM, ['--check', 'deck.ini'], { cwd: folder, encoding: 'utf8' }).stderr.trim().split('\n');
  assert.deepEqual(refused(wrong, 0.01), said.map((line) => line.replace('millsim: deck.ini', 'deck')));
  const [line, ...more] = refused(SMALL, 0.01, ['balls.count=20000']);
  assert.ok(line.includes('do not fit') && !more.length);
  assert.ok(refused(text('stl'), 0.01).some((one) => one.includes('file') && one.includes('rotor.stl')));
  assert.equal(run(SMALL, 0.02).work, before.work);
});

test('files have the names that the deck gives them', () => {
  for (const name of ['./rotor.stl', 'a </../script>.stl']) {
    run(text('stl').replace(/^file = .*/m, `file = ${name}`), 1e-6, [], { files: new Map([[name, STL]]) });
  }
});

test('powder, heat and wear are understood, and other units are told with the known ones', () => {
  const more = '[powder]\nmass = 5 g\ndensity = 4 g/cm^3\n[heat]\nball_heat_capacity = 460 J/kg/K\njar_heat_capacity = 0.46 kJ/kg/K\njar_mass = 2 kg\nball_to_jar = 1 W/K\njar_to_room = 0 W/K\n[wear]\nhardness = 3 GPa\n';
  const { mill } = run(SMALL + more, 0.001), value = (name) => mill.keys.find((one) => `${one.section}.${one.key}` === name).value;
  assert.deepEqual(['powder.modulus', 'powder.threshold', 'heat.jar_heat_capacity', 'wear.hardness'].map(value), ['115000000000 Pa', 'auto', '460 J/kg/K', '3000000000 Pa']);
  const [line] = refused(SMALL.replace('radius = 30 mm', 'radius = 0.02 fathom'), 0.01);
  assert.match(line, /got '0.02 fathom' \(unknown unit 'fathom'; the studio knows m, mm, cm, inch, in, um, nm\)$/);
});

test('the memory of a design is given back', () => {
  const sizes = Array.from({ length: 60 }, (_, k) => {
    run(SMALL, 0.001, [`balls.count=${10 + (k % 10)}`]);
    return engine.memory;
  });
  // the allocator may split its memory a little differently; 15 kB left behind by each design would be too much
  assert.ok(sizes[59] - sizes[19] < 40 * 15_000);
});

test("keys have the bounds of the deck's table", () => {
  const keys = Object.fromEntries(run(SMALL, 0.001).mill.keys.map((key) => [`${key.section}.${key.key}`, key]));
  const { lo, hi, above } = keys['contact.restitution'], radius = keys['drum.radius'];
  assert.deepEqual([lo, hi, above], [0, 1, 0]);
  assert.deepEqual([radius.unit, radius.lo, radius.above, radius.value], ['m', 1e-9, 0, '0.03 m']);
  assert.deepEqual([keys['drum.profile'].words, keys['balls.fill'].instead], ['circle|wavy|lifters|harmonics|file', 'count']);
  assert.ok(Object.values(keys).every((key) => key.meaning));
});
