// Costs of weftd's page, each beside its limit: time from the daemon's start to the first chart, bytes, frames a second, and the daemon's load by
// open pages. SIMULATED bench, real browser (Debian's chromium, without a window).
//   node page.mjs WEFTD WEFT SOURCE_ROOT        writes out/bench/page.json
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import os from 'node:os';
import { join } from 'node:path';
import { gzipSync } from 'node:zlib';
import { Daemon, ROOT, connected, open_browser, open_page, says } from '../web/support.mjs';

const starts = 7;
const windows = 3;
const window_s = 10;
const ticks_hz = 100; // unit of /proc/PID/stat, sysconf(_SC_CLK_TCK) on Linux
const rows = [];

const median = (values) => [...values].sort((a, b) => a - b)[Math.floor(values.length / 2)];
const later = (seconds) => new Promise((done) => { setTimeout(done, 1000 * seconds); });

function tell(name, value, unit, limit) {
  rows.push({ name, value, unit, limit: limit ?? null });
  console.log(`${name.padEnd(58)} ${value.toPrecision(4).padStart(10)} ${unit.padEnd(12)} ${limit ?? ''}`);
}

const chart_is_drawn = () => [...document.querySelectorAll('#chart-force canvas')].some((canvas) =>
  canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data.some((value) => value !== 0));

/** Times [ms] in the page's own clock, from its navigation: the scripts are loaded; the first chart is drawn. */
const times_in_page = () => ({
  html_ms: performance.getEntriesByType('navigation')[0].responseEnd,
  scripts_ms: Math.max(...performance.getEntriesByType('resource').filter((one) => one.name.endsWith('.js')).map((one) => one.responseEnd)),
  chart_ms: performance.getEntriesByName('first-chart')[0].startTime,
});

/** Marks the first chart from inside the page, without polling from outside. */
async function mark_first_chart(page) {
  await page.addInitScript(() => {
    const look = () => (document.querySelector('#chart-force canvas') ? performance.mark('first-chart') : requestAnimationFrame(look));
    requestAnimationFrame(look);
  });
}

/** Repeatedly starts the daemon and opens its page in a running browser with an empty tab. */
async function from_start_to_chart() {
  const daemon = await new Daemon().begin();
  const link = daemon.link();
  await daemon.end();
  const found = { tab: [], ready: [], html: [], scripts: [], chart: [], all: [] };
  for (let at = 0; at < starts; ++at) {
    const before = performance.now();
    const page = await (await (await open_browser()).newContext()).newPage();
    await mark_first_chart(page);
    const began = performance.now();
    found.tab.push(began - before);
    await daemon.begin();
    found.ready.push(performance.now() - began);
    await page.goto(link, { waitUntil: 'commit' });
    await page.waitForFunction(chart_is_drawn);
    found.all.push(performance.now() - began);
    const { html_ms, scripts_ms, chart_ms } = await page.evaluate(times_in_page);
    found.html.push(html_ms);
    found.scripts.push(scripts_ms);
    found.chart.push(chart_ms);
    await page.context().close();
    await daemon.end();
  }
  await daemon.close();
  const of = `median of ${starts}`;
  tell('the browser opens an empty tab (in no figure below)', median(found.tab), 'ms', of);
  tell('weftd ready', median(found.ready), 'ms', of);
  tell('page: from its address to the HTML', median(found.html), 'ms', of);
  tell('page: ... to its last script', median(found.scripts), 'ms', of);
  tell('page: ... to the first chart drawn', median(found.chart), 'ms', of);
  tell('from the start of weftd to the first chart', median(found.all), 'ms', `${of}; 300 ms wanted of the page`);
}

/** Time until the charts of a page opened during a campaign have a line. */
async function to_first_sample() {
  const daemon = await new Daemon().begin('--pace', '1');
  daemon.weft('start', 'small');
  const link = daemon.link();
  await later(5);
  const found = [];
  for (let at = 0; at < starts; ++at) {
    const page = await (await (await open_browser()).newContext()).newPage();
    await page.goto(link, { waitUntil: 'commit' });
    const told = await page.waitForFunction(() => /\d/.test(document.querySelector('#chart-force-key .figure')?.textContent ?? '') && performance.now());
    found.push(await told.jsonValue());
    await page.context().close();
  }
  await daemon.close();
  tell('page: from its address to the first sample', median(found), 'ms', `median of ${starts}, a campaign under way`);
}

/** Bytes as the browser fetched them. */
async function bytes_of(page, daemon) {
  const paths = await page.evaluate(() => ['/', ...performance.getEntriesByType('resource').map((entry) => new URL(entry.name).pathname)]);
  let whole = 0;
  let packed = 0;
  for (const path of new Set(paths.filter((one) => one !== '/rpc' && one !== '/events'))) {
    const bytes = Buffer.from(await (await fetch(`http://127.0.0.1:${daemon.http}${path}`)).arrayBuffer());
    whole += bytes.length;
    packed += gzipSync(bytes, { level: 9 }).length;
  }
  tell('bytes of the page', whole / 1000, 'kB', '');
  tell('the same, each file by gzip -9', packed / 1000, 'kB', 'not served so');
}

/** Intervals between frames, and how often a chart was redrawn. */
async function frames_of(page) {
  const seen = await page.evaluate((seconds) => new Promise((done) => {
    const intervals = [];
    let drawn = 0;
    const clear = CanvasRenderingContext2D.prototype.clearRect;
    CanvasRenderingContext2D.prototype.clearRect = function (...area) {
      if (this.canvas.id === 'pads') ++drawn;
      return clear.apply(this, area);
    };
    const began = performance.now();
    let last = began;
    const turn = (now) => {
      intervals.push(now - last);
      last = now;
      if (now - began < 1000 * seconds) return requestAnimationFrame(turn);
      CanvasRenderingContext2D.prototype.clearRect = clear;
      return done({ intervals, drawn, seconds: (now - began) / 1000 });
    };
    requestAnimationFrame(turn);
  }), window_s);
  const sorted = [...seen.intervals].sort((a, b) => a - b);
  tell('frames a second, 16 pads and 6 force channels', seen.intervals.length / seen.seconds, 'Hz', 'limit 60');
  tell('between two frames, median', median(sorted), 'ms', '16.7 is 60 Hz');
  tell('between two frames, 95 of 100 at most', sorted[Math.floor(sorted.length * 0.95)], 'ms', '');
  tell('new scans of the pads drawn', seen.drawn / seen.seconds, 'Hz', 'the array gives 37 a second');
}

function cpu_s(pid) {
  const fields = readFileSync(`/proc/${pid}/stat`, 'utf8').split(') ').at(-1).split(' ');
  return (Number(fields[11]) + Number(fields[12])) / ticks_hz;
}

async function share_of_a_core(daemon) {
  const shares = [];
  for (let at = 0; at < windows; ++at) {
    const [before, began] = [cpu_s(daemon.process.pid), performance.now()];
    await later(window_s);
    shares.push((100 * (cpu_s(daemon.process.pid) - before)) / ((performance.now() - began) / 1000));
  }
  return median(shares);
}

/** Reads like pages do, but without drawing. Pages that draw take the cores from the daemon, which then sends less. */
async function read_as_pages_do(daemon, link, count) {
  const topics = 'run:*,rig,queue,lease:*,vote:*,stream:force,stream:stages,stream:taxels';
  const headers = { Authorization: `Bearer ${link.split('token=')[1]}` };
  const readers = [];
  for (let at = 0; at < count; ++at) {
    const stop = new AbortController();
    const stream = await fetch(`http://127.0.0.1:${daemon.http}/events?mode=latest&max_hz=60&topics=${topics}`, { headers, signal: stop.signal });
    if (stream.status !== 200) throw new Error(`no stream: ${stream.status}`);
    drain(stream.body).catch((error) => { if (error.name !== 'AbortError') throw error; });
    readers.push(stop);
  }
  return readers;
}

async function drain(body) {
  for await (const bytes of body) if (bytes.length === 0) return;
}

async function with_pages() {
  const daemon = await new Daemon().begin('--pace', '1');
  daemon.weft('start', 'small');
  const link = daemon.link();
  await later(5);
  const none = await share_of_a_core(daemon);
  tell('daemon, a campaign at real time, no page', none, '% of a core', `median of ${windows} x ${window_s} s`);
  const pages = [await open_page(link)];
  await connected(pages[0]);
  await says(pages[0], '#pads-range', /counts/);
  await bytes_of(pages[0], daemon);
  await frames_of(pages[0]);
  const one = await share_of_a_core(daemon);
  tell('one page costs the daemon', one - none, '% of a core', 'limit 2');
  while (pages.length < 10) pages.push(await open_page(link));
  for (const page of pages) await connected(page);
  const ten = await share_of_a_core(daemon);
  tell('ten pages cost the daemon, drawing on the same cores', ten - none, '% of a core', 'limit 2 a page');
  for (const page of pages) await page.context().close();
  const readers = await read_as_pages_do(daemon, link, 10);
  tell('ten readers of the page\'s stream, which draw nothing', (await share_of_a_core(daemon)) - none, '% of a core', 'limit 2 a page');
  for (const reader of readers) reader.abort();
  await daemon.close();
}

console.log(`the page of weftd, SIMULATED bench; ${os.cpus().length} cores, ${os.loadavg()[0].toFixed(1)} others want one`);
await from_start_to_chart();
await to_first_sample();
if (process.env.WEFT_BENCH_QUICK === undefined) await with_pages();
await (await open_browser()).close();
mkdirSync(join(ROOT, 'out/bench'), { recursive: true });
writeFileSync(join(ROOT, 'out/bench/page.json'), JSON.stringify({ bench: 'page', commit: process.env.WEFT_COMMIT ?? 'unknown', simulated: true, figures: rows }, null, 1));
