// The part of the page of `mill watch` that asks the server, with a server that only pretends
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { load, rest, until } from './page.mjs';

const { WatchSource } = load(['WatchSource'], 'watch/source.js');
Object.assign(WatchSource, { OFTEN: 10, SELDOM: 10, FIRST: 4 }); // [ms]
const { setTimeout } = globalThis;
globalThis.setTimeout = (...words) => setTimeout(...words).unref(); // a source asks for ever
const packed = (kind, values) => ({ [kind]: Buffer.from(new WatchSource.KINDS[kind](values).buffer).toString('base64') });
const messages = (heard, type) => heard.filter((one) => one.type === type);

/** A source of an ended run of so many states, five in an answer, with what it has told; `server` can be changed. */
function watched(states = 12) {
  const server = { mill: 'a', ended: true, down: false };
  globalThis.fetch = async (place) => {
    const { pathname, searchParams: asked } = new URL(place, 'http://here'), since = Math.max(Number(asked.get('since')), 0);
    if (server.down) throw new TypeError('Failed to fetch');
    if (!pathname.startsWith('/token/')) return { ok: false, status: 404, statusText: 'Not Found' };
    const found = Array.from({ length: Math.min(5, states - since) }, (_, k) => ({ type: 'state', time: since + k, positions: packed('f4', [since + k, 0.5, -1]), ended: since + k === states - 1 }));
    const news = asked.get('seen') === '1' ? [] : [{ type: 'results', spectrum: { count: { all: packed('f8', [0.1, 1e300]) } } }, { type: 'progress', done: 0.4, left: 3, note: 'about 3 s left' }];
    const mill = { mill: server.mill, message: { type: 'mill', head: { colours: packed('u1', [255]), corners: packed('u4', [70000]) } } };
    return { ok: true, json: async () => (pathname.endsWith('mill.json') ? mill
      : { mill: server.mill, next: since + found.length, seen: 1, every: 0.05, ended: server.ended, news, states: found }) };
  };
  const source = new WatchSource('/token/'), heard = [];
  source.on = (message) => { heard.push({ ...message, at: performance.now() }); };
  return { source, server, heard };
}

test('the mill is heard first, then every state in its order, and the results once', async () => {
  const { source, heard } = watched();
  source.run();
  await until(() => heard.some((one) => one.ended));
  assert.deepEqual(messages(heard, 'state').map(({ time, positions }) => [time, ...positions]), Array.from({ length: 12 }, (_, k) => [k, k, 0.5, -1]));
  assert.deepEqual([heard[0].type, messages(heard, 'mill').length, messages(heard, 'results').length, source.live], ['mill', 1, 1, false]);
  assert.deepEqual([heard[0].head, messages(heard, 'results')[0].spectrum.count.all], [{ colours: Uint8Array.of(255), corners: Uint32Array.of(70000) }, Float64Array.of(0.1, 1e300)]);
  assert.deepEqual(messages(heard, 'progress')[0].left, null); // the note has it in words
  const gaps = messages(heard, 'state').map(({ at }) => at).map((at, k, all) => at - all[k - 1]).slice(1);
  assert.ok(Math.min(...gaps) > 2, `${gaps}`); // [ms] one by one, though five come at a time
});

test('a pause holds the states, and the end can be played again', async () => {
  const { source, heard } = watched(), ends = () => heard.filter((one) => one.ended).length;
  source.run();
  await until(() => messages(heard, 'state').length > 3);
  source.pause();
  const before = messages(heard, 'state').length;
  await rest(60);
  assert.equal(messages(heard, 'state').length, before);
  source.run();
  await until(() => ends() === 1);
  await until(() => { source.run(); return ends() > 1; });
  assert.deepEqual(messages(heard, 'state').slice(12, 14).map(({ time }) => time), [0, 1]);
});

test('without play the first state is shown', async () => {
  const { heard } = watched();
  await until(() => messages(heard, 'state').length);
  await rest(60);
  assert.equal(messages(heard, 'state').length, 1);
});

test('another run in the same file is another mill, from its beginning', async () => {
  const { source, server, heard } = watched();
  source.run();
  await until(() => heard.some((one) => one.ended));
  server.mill = 'b';
  await until(() => messages(heard, 'mill').length === 2);
  await until(() => heard.filter((one) => one.ended).length === 2);
  assert.deepEqual(messages(heard, 'state').slice(12).map(({ time }) => time), Array.from({ length: 12 }, (_, k) => k));
});

test('it says when the command has gone, and goes on when it is back', async () => {
  const { source, server, heard } = watched();
  server.ended = false;
  source.run();
  await until(() => messages(heard, 'mill').length);
  server.down = true;
  await until(() => heard.at(-1).note?.startsWith('no news: mill watch has ended'));
  Object.assign(server, { down: false, ended: true });
  await until(() => heard.some((one) => one.ended));
});
