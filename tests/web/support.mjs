// weftd and a browser for the tests of the page: a daemon on the simulated bench with small recipes, and pages that report every error.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import net from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { chromium } from 'playwright-core';

export const [WEFTD, WEFT, ROOT] = process.argv.slice(2);
export const patience_ms = 120000;
export const desktop = { width: 1440, height: 900 };
export const phone = { width: 390, height: 844 };

/** The library's M1 with other fields. */
export function recipe(fields) {
  const { $schema, ...library } = JSON.parse(readFileSync(join(ROOT, 'recipes/library/m1.json'), 'utf8'));
  return { ...library, ...fields };
}

/** The library's M1 with another force in its phases. */
function with_force(force_N) {
  const { M1 } = recipe({}).explorations;
  return { M1: { ...M1, phases: M1.phases.map((phase) => ('force_N' in phase ? { ...phase, force_N } : phase)) } };
}

export const recipes = {
  plain: recipe({ name: 'plain', description: 'Two fabrics, four times each.', fabrics: ['denim', 'silk'], repetitions: 4 }), // no evaluation settings
  small: recipe({ name: 'small', fabrics: ['denim', 'silk'], repetitions: 4, hand_over: { from: 'taxels', learner: 'svc', groups: 2 } }),
  first: JSON.parse(readFileSync(join(ROOT, 'recipes/library/first.json'), 'utf8')), // the tutorial's recipe
  broken: recipe({ name: 'broken', fabrics: ['denim', 'tweed'] }),
  open_force: recipe({ name: 'open_force', fabrics: ['denim', 'silk'], repetitions: 1, parameters: { force_N: { type: 'number', unit: 'N', min: 1, max: 8 } },
    explorations: with_force({ parameter: 'force_N' }) }),
  people: recipe({ name: 'people', fabrics: ['denim', 'silk'], repetitions: 1,
    operator_steps: [{ before: 'fabric', text: 'Mount {fabric}, smooth it, close the clamps', people_s: 60 }] }),
};

/** The daemon, with its own folder of recipes and data; `http` 0 takes a free port. */
export class Daemon {
  constructor(folder = mkdtempSync(join(tmpdir(), 'weft-web-'))) {
    this.folder = folder;
    this.http = 0;
    this.rig = join(ROOT, 'sim/rigs/bench17.json');
    mkdirSync(join(folder, 'recipes'));
    for (const [name, text] of Object.entries(recipes)) writeFileSync(join(folder, 'recipes', `${name}.json`), JSON.stringify(text));
  }

  /** Starts the daemon; after a first start on the same port. */
  async begin(...more) {
    this.process = spawn(WEFTD, ['--rig', this.rig, '--recipes', join(this.folder, 'recipes'),
      '--data', join(this.folder, 'data'), '--http', String(this.http), ...more], { stdio: ['ignore', 'pipe', 'inherit'] });
    this.ended = new Promise((done) => { this.process.once('exit', done); });
    const line = await new Promise((done, failed) => {
      this.process.stdout.once('data', (bytes) => done(String(bytes)));
      this.process.once('exit', (code) => failed(new Error(`weftd ended with ${code}`)));
    });
    this.http = Number(/http:\/\/[^:]+:(\d+)/.exec(line)[1]);
    return this;
  }

  async end(how = 'SIGTERM') {
    this.process.kill(how);
    await this.ended;
  }

  async close() {
    if (this.process.exitCode === null && this.process.signalCode === null) await this.end();
    rmSync(this.folder, { recursive: true, force: true });
  }

  weft(...words) {
    return execFileSync(WEFT, [...words, '--socket', join(this.folder, 'data/weftd.sock')], { encoding: 'utf8' });
  }

  call(method, params = {}) {
    return JSON.parse(this.weft('call', method, JSON.stringify(params)));
  }

  /** Output of `weft page`; with `port` the link leads to a relay in front of the daemon. */
  link(port = this.http, ...more) {
    return this.weft('page', ...more).trim().replace(`:${this.http}/`, `:${port}/`);
  }

  get runs() {
    return this.call('run.list').runs;
  }
}

/** Relays between page and daemon; can cut the connection, or make it silent like that of a sleeping machine. */
export class Relay {
  #pairs = new Set();

  async begin(target) {
    this.open = true;
    this.server = net.createServer((near) => {
      if (!this.open) return near.destroy();
      const far = net.connect(target, '127.0.0.1');
      const pair = [near, far];
      this.#pairs.add(pair);
      near.pipe(far);
      far.pipe(near);
      for (const side of pair) {
        side.on('error', () => {});
        side.on('close', () => { near.destroy(); far.destroy(); this.#pairs.delete(pair); });
      }
    });
    await new Promise((done) => { this.server.listen(0, '127.0.0.1', done); });
    this.port = this.server.address().port;
    return this;
  }

  /** Stops all traffic without closing a connection. */
  go_quiet() {
    this.open = false;
    for (const [near, far] of this.#pairs) {
      near.unpipe();
      far.unpipe();
      near.pause();
      far.pause();
    }
  }

  cut() {
    this.open = false;
    for (const [near] of this.#pairs) near.destroy();
  }

  let_through() {
    this.cut();
    this.open = true;
  }

  close() {
    this.cut();
    this.server.close();
  }
}

let browser;
export async function open_browser() {
  browser ??= await chromium.launch({ executablePath: '/usr/bin/chromium', args: ['--no-sandbox'] });
  return browser;
}

const network = /Failed to load resource/;

/** A page with `troubles`: all its errors, except connections that a test cuts. */
export async function open_page(link, { viewport = desktop, colorScheme = 'light', before = async () => {} } = {}) {
  const context = await (await open_browser()).newContext({ viewport, colorScheme, acceptDownloads: true });
  const page = await context.newPage();
  page.setDefaultTimeout(patience_ms);
  page.troubles = [];
  page.on('pageerror', (error) => page.troubles.push(error.stack));
  page.on('console', (message) => {
    if (message.type() === 'error' && !network.test(message.text())) page.troubles.push(message.text());
  });
  await page.addInitScript(() => {
    addEventListener('securitypolicyviolation', (event) => console.error(`policy: ${event.violatedDirective} ${event.blockedURI}`));
  });
  await before(page);
  await page.goto(link);
  return page;
}

export async function see(page, view) {
  await page.click(`nav a[href="#${view}"]`);
  await page.waitForSelector(`#view-${view}:not([hidden])`);
}

/** Waits until an element's text matches. */
export async function says(page, selector, pattern, timeout = patience_ms) {
  try {
    await page.waitForFunction(([where, source]) => new RegExp(source, 's').test(document.querySelector(where)?.innerText ?? ''),
      [selector, pattern.source], { timeout });
  } catch (error) {
    throw new Error(`${selector} says "${await page.textContent(selector).catch(() => 'nothing')}", not ${pattern} (${error.message.split('\n')[0]})`);
  }
}

export const connected = (page) => says(page, '#connection-text', /^live$/);

/** Chooses a recipe and starts it. */
export async function start(page, name) {
  await see(page, 'start');
  await page.check(`input[value=${name}]`);
  await page.waitForSelector('#checked .verdict.good');
  await page.click('#start-buttons [data-key=start]');
  await page.waitForSelector('#view-live:not([hidden])');
}

export async function set_pace(page, pace) {
  await see(page, 'live');
  await page.selectOption('#pace', String(pace));
}

/** Fails on a serious or critical finding of axe, and if the page scrolls sideways. */
export async function judge(page, what) {
  await page.evaluate(readFileSync(new URL('node_modules/axe-core/axe.min.js', import.meta.url), 'utf8'));
  const { violations } = await page.evaluate(() => globalThis.axe.run(document, { resultTypes: ['violations'] }));
  const grave = violations.filter(({ impact }) => impact === 'serious' || impact === 'critical')
    .map(({ id, nodes }) => `${what}: ${id}: ${nodes.map((node) => `${node.html} ${node.failureSummary}`).join('\n')}`);
  assert.deepEqual(grave, []);
  const wider = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  assert.ok(wider <= 0, `${what} scrolls sideways by ${wider} px`);
}

/** Runs a test with its own daemon, and fails if a page had an error. */
export async function with_daemon(test, ...options) {
  const daemon = await new Daemon().begin(...options);
  const pages = [];
  try {
    await test(daemon, async (link, more) => {
      const page = await open_page(link, more);
      pages.push(page);
      return page;
    });
    for (const page of pages) assert.deepEqual(page.troubles, []);
  } catch (error) {
    for (const page of pages) console.error('the page:', page.troubles, (await page.textContent('#troubles').catch(() => '')));
    throw error;
  } finally {
    await browser?.close();
    browser = undefined;
    await daemon.close();
  }
}
