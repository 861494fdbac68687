// Scripts of pages without a browser: run as in a page, one after the other in one global scope.
import { readFileSync } from 'node:fs';
import { Duplex } from 'node:stream';
import { runInThisContext } from 'node:vm';
import zlib from 'node:zlib';

export const ROOT = new URL('../../', import.meta.url);
// that of Node 18 does not know deflate-raw
globalThis.CompressionStream = function () { return Duplex.toWeb(zlib.createDeflateRaw()); };
globalThis.DecompressionStream = function () { return Duplex.toWeb(zlib.createInflateRaw()); };

/** Runs scripts of tools/milltools (or others, by their paths from the root); returns what the names stand for then. */
export function load(names, ...paths) {
  globalThis.window = globalThis;
  for (const path of paths) {
    const file = new URL(path.startsWith('tests/') ? path : `tools/milltools/${path}`, ROOT);
    runInThisContext(readFileSync(file, 'utf8'), { filename: file.pathname });
  }
  return runInThisContext(`({${names.join()}})`);
}

/** Waits so long [ms], also where nothing else keeps the process. */
const later = setTimeout;
export const rest = (wait) => new Promise((resolve) => { later(resolve, wait); });

/** Waits until a function is true; resolves to its value. */
export async function until(made, seconds = 20) {
  const end = performance.now() + 1000 * seconds;
  for (;;) {
    const found = made();
    if (found) return found;
    if (performance.now() > end) throw new Error(`never came true: ${made}`);
    await rest(2);
  }
}
