/* The worker of the studio: simulates the mill at the pace that the page asks for, and posts states and results. Begins
   with engine.js; source.js is at the other end. */
'use strict';

let engine = null;
let pace = null; // {factor, wall [ms], time [s]}: since then, so many simulated seconds a second; null: paused
let events = 2000; // of a slice
let seen = true; // the page has drawn the last state
let past = []; // [wall in ms, simulated s, impacts] of about the last second
const last = { state: 0, results: 0, cost: 0 }; // [ms]
const SLICE = 8, PICTURE = 1000 / 60, RESULTS = 300, LATE = 100; // [ms]
const turn = new MessageChannel(); // what comes in meanwhile is heard first
turn.port1.onmessage = () => step();

function tell(message, moved = []) {
  postMessage(message, moved);
}

function fail(fault) {
  pace = null;
  tell({ type: 'failed', lines: fault.lines ?? [String(fault.message ?? fault)] });
}

function tellState(now, ended) {
  const state = engine.state();
  past.push([now, state.time, state.contacts]);
  while (past.length > 2 && now - past[0][0] > 1000) past.shift();
  const [wall, time, contacts] = past[0], passed = Math.max(now - wall, 1) / 1000;
  seen = false;
  last.state = now;
  tell({ type: 'state', ...state, ended, factor: pace ? (state.time - time) / passed : 0,
    rate: pace ? (state.contacts - contacts) / passed : 0 }, [state.positions.buffer, state.speeds.buffer]);
  return state.time;
}

function tellResults() {
  const begin = performance.now();
  tell({ type: 'results', ...engine.results() });
  last.results = performance.now();
  last.cost = last.results - begin;
}

/** A slice of the run: not beyond the simulated time that is due. */
function step() {
  if (!pace) return;
  try {
    const begin = performance.now();
    let due = pace.factor === Infinity ? Infinity : pace.time + ((begin - pace.wall) / 1000) * pace.factor;
    const before = engine.time;
    if (due - before > (LATE / 1000) * pace.factor && pace.factor !== Infinity) { // too slow: from here on
      pace = { ...pace, wall: begin, time: before };
      due = before + (PICTURE / 1000) * pace.factor;
    }
    const ended = engine.run(due, events);
    const took = performance.now() - begin;
    if (engine.time < due) events = Math.min(Math.max((events * SLICE) / Math.max(took, 0.1), events / 4, 200), events * 4, 1e6);
    const now = performance.now();
    if ((seen && now - last.state >= PICTURE - 2) || ended) tellState(now, ended);
    if (now - last.results >= Math.max(RESULTS, 10 * last.cost) || ended) tellResults();
    if (ended) pace = null;
    else if (engine.time < due) turn.port2.postMessage(null);
    else setTimeout(step, 4);
  } catch (fault) {
    fail(fault);
  }
}

const tasks = {
  async start({ bytes }) {
    engine = await MillEngine.start(bytes);
    tell({ type: 'ready' });
  },
  load({ deck, set, files }) {
    const mill = engine.load(deck, set, files);
    const outlines = [-1, ...mill.motions.keys()].map((k) => engine.outline(k));
    pace = null;
    past = [];
    tell({ type: 'mill', mill, outlines, state: engine.state() });
    tellState(performance.now(), false);
  },
  run({ factor }) {
    if (!engine?.kinds) return;
    const going = pace;
    pace = { factor, wall: performance.now(), time: engine.time };
    past = [];
    if (!going) step();
  },
  pause() {
    pace = null;
    if (engine?.kinds) {
      tellState(performance.now(), false);
      tellResults();
    }
  },
  /** The mill goes on for a time [s], and pauses. */
  advance({ by }) {
    pace = null;
    const ended = engine.run(engine.time + by, 1e12);
    tellState(performance.now(), ended);
    tellResults();
  },
  seen() {
    seen = true;
  },
};

let before = Promise.resolve(); // tasks wait for each other, and all of them for the engine
onmessage = ({ data }) => {
  before = before.then(() => tasks[data.task](data)).catch(fail);
};
