// The laboratory's page with a real PostgreSQL store and 100 made-up rigs: values, order, hostile texts, search, a phone, the store's loss. SIMULATED.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { join } from 'node:path';
import { createInterface } from 'node:readline';
import { connected, desktop, judge, open_browser, says, see, with_daemon, ROOT, WEFT } from './support.mjs';

const narrow = { width: 360, height: 780 };
const most_asks = 4; // in 5 s; the view asks every 2 s
const evil = '<img src=x onerror="document.title=\'owned\'">';
const turned = '\u202Eevil\u202D ';
const long = 'x'.repeat(5000);

/** PostgreSQL of this test; ends with its input. */
async function begin_server() {
  const program = spawn('python3', [join(ROOT, 'tests/web/lab_server.py')], { stdio: ['pipe', 'pipe', 'inherit'], env: { ...process.env, PYTHONDONTWRITEBYTECODE: '1' } });
  const lines = createInterface({ input: program.stdout })[Symbol.asyncIterator]();
  const ended = new Promise((done) => { program.once('exit', done); });
  const { value: folder } = await lines.next();
  if (!folder?.startsWith('/')) {
    console.log(folder);
    process.exit(await ended);
  }
  return {
    uri: (login) => `postgresql://${login}@/lab?host=${folder}`,
    sql(text) {
      return execFileSync('psql', ['-X', '-q', '-A', '-t', '-v', 'ON_ERROR_STOP=1', '-d', this.uri('admin')], { input: text, encoding: 'utf8' });
    },
    async order(word) {
      program.stdin.write(`${word}\n`);
      assert.equal((await lines.next()).value, 'done');
    },
    async close() {
      program.stdin.end();
      await ended;
    },
  };
}

const quoted = (text) => `'${text.replaceAll("'", "''")}'`;
const login_of = (name) => `"login of ${name.replaceAll('"', '""')}"`;
const inserted = (names) => names.map((name) => `CREATE ROLE ${login_of(name)} LOGIN; GRANT weft_rig TO ${login_of(name)};`).join('\n');

/** Each rig publishes itself as its own login. `json`: its status as text, where it is not JSON of JavaScript. */
const published = (rigs) => rigs.map(({ name, bench = 'simulated', state = 'safe', status = {}, json = JSON.stringify(status) }) =>
  `SET SESSION AUTHORIZATION ${login_of(name)}; DO $do$ BEGIN PERFORM weft.publish_rig(${quoted(name)}, 'tls://x', '${bench}', ${quoted(state)}, '', ${quoted(json)}); END $do$;`)
  .join('\n') + '\nRESET SESSION AUTHORIZATION;';

const us = (seconds) => Math.round((Date.now() / 1000 + seconds) * 1e6);
const running = (more) => ({ run: 'R-000007', recipe: 'khan2016', run_state: 'running', trial: 12, trials: 340, eta_s: 7500, ...more });

function special_rigs() {
  return [
    { name: 'z-alarm', bench: 'real', state: 'latched', status: { alarms: ['emergency stop', 'queue paused by ada'], http: 'https://bench9.example:8443' } },
    { name: 'y-open', state: 'holding', status: running({ run_state: 'awaiting_operator', next_action: 'Mount velvet', next_action_us: us(-600), http: 'http://bench8.example:8080/' }) },
    { name: 'x-soon', state: 'moving', status: running({ next_action: 'Mount wool', next_action_us: us(600), part: { campaign: 'C-000003', fabric: 'wool' } }) },
    { name: 'w-later', state: 'moving', status: running({ next_action: 'Mount silk', next_action_us: us(7260), http: 'http://127.0.0.1:8081/' }) },
    { name: 'v-whenever', state: 'moving', status: running({ next_action: 'Mount tulle', eta_s: null }) },
    { name: evil, state: 'safe hidden', status: { alarms: [evil, turned + evil], next_action: evil, run: evil, recipe: evil, run_state: evil, part: { campaign: evil, fabric: evil }, http: 'javascript:alert(1)' } },
    { name: 'odd-1', state: long, status: { alarms: { length: 7 }, next_action: ['a'], next_action_us: 'soon', run: long, recipe: long, trial: -1, trials: 1e300, eta_s: 1e300, part: 'no', http: 'https://ada:secret@bench7.example/' } },
    { name: 'odd-2', json: '{"trials": 1e999, "alarms": ["unreadable"]}' },
    { name: 'odd-3', json: `{"next_action_us": -5, "http": "data:text/html,x", "status": ${'['.repeat(3000)}${']'.repeat(3000)}, "part": []}` },
    { name: 'odd-4', status: { alarms: Array.from({ length: 1000 }, (_, at) => `alarm ${at}`) } },
  ];
}

const plain_rigs = (count) => Array.from({ length: count }, (_, at) => ({ name: `rig ${at + 1}`, bench: at % 2 ? 'real' : 'simulated', state: 'moving', status: running({ trial: at }) }));

const names = (page) => page.$$eval('#lab-list tbody tr:not([hidden])', (rows) => rows.map((row) => row.dataset.rig));
const row = (name) => `#lab-list tr[data-rig="${name}"]`;

const cells = (page, name) => page.$$eval(`${row(name)} > *`, (found) => found.map((cell) => cell.innerText.replace(/\s+/g, ' ').trim()));
const minute = (t_us) => new Date(t_us / 1000).toTimeString().slice(0, 5);

async function check_order(page) {
  const shown = await names(page);
  assert.deepEqual(shown.slice(0, 12), [evil, 'odd-1', 'odd-2', 'odd-4', 'z-alarm', 'y-open', 'x-soon', 'w-later', 'v-whenever', 'bench17', 'odd-3', 'rig 1']);
  assert.deepEqual(shown.slice(-2), ['rig 88', 'rig 89'], 'numbers in names are in order');
  assert.equal(shown.length, 100);
  await says(page, '#lab-count', /^100 rigs, 5 with an alarm, 1 waiting for a person$/);
}

async function check_values(page, rigs) {
  const of = (name) => rigs.find((rig) => rig.name === name).status;
  assert.deepEqual(await cells(page, 'z-alarm'), ['z-alarm real bench bench9.example:8443 ↗', 'ALARM emergency stop ALARM queue paused by ada', 'latched', 'no run', '–']);
  const [name, person, state, run, time] = await cells(page, 'y-open');
  assert.deepEqual([name, state, run], ['y-open SIMULATED bench8.example:8080 ↗', 'holding', 'R-000007 khan2016 awaiting operator 12 of 340 trials']);
  assert.match(person, new RegExp(`^now, since (.* )?${minute(of('y-open').next_action_us)}: Mount velvet$`));
  assert.match(time, /^2 h [45] min left ends about (\d{4}-\d\d-\d\d )?\d\d:\d\d$/);
  const soon = await cells(page, 'x-soon');
  assert.match(soon[1], new RegExp(`^in (9|10) min, (.* )?${minute(of('x-soon').next_action_us)}: Mount wool$`));
  assert.match(soon[3], /part of C-000003: wool$/);
  assert.deepEqual((await cells(page, 'v-whenever')).slice(1), ['later: Mount tulle', 'moving', 'R-000007 khan2016 12 of 340 trials', '–']);
  assert.equal(await page.$eval(`${row('y-open')} progress`, (bar) => bar.value / bar.max), 12 / 340);
  assert.deepEqual((await cells(page, 'bench17')).slice(0, 2), ['bench17 SIMULATED this rig', 'nothing']);
  const links = await page.$$eval('#lab-list a', (found) => found.map((link) => [link.closest('tr').dataset.rig, link.getAttribute('href'), link.rel]));
  assert.deepEqual(links, [['z-alarm', 'https://bench9.example:8443/', 'noopener noreferrer'], ['y-open', 'http://bench8.example:8080/', 'noopener noreferrer'],
    ['w-later', 'http://127.0.0.1:8081/', 'noopener noreferrer'], ['bench17', '#live', '']]);
}

/** Texts of other rigs are text, whatever they contain; a rig that publishes nonsense does not hide the others. */
async function check_hostile(page) {
  assert.equal(await page.locator('#lab-list :is(img, script, iframe, style)').count(), 0);
  assert.doesNotMatch(await page.title(), /owned/);
  const [name, person, state, run] = await page.$$eval('#lab-list tbody tr:first-child > *', (found) => found.map((cell) => cell.innerText));
  assert.ok([name, person, run].every((text) => text.includes(evil)), run);
  assert.equal(await page.locator('#lab-list tbody tr:first-child bdi', { hasText: 'evil' }).count(), 1);
  assert.equal(state.trim(), 'safe hidden');
  assert.equal(await page.$eval('#lab-list tbody tr:first-child td:nth-child(3) span', (span) => span.className), 'fact', 'a rig chooses no classes');
  const odd = await cells(page, 'odd-1');
  assert.ok(odd.every((text) => text.length < 400), odd.map((text) => text.length).join());
  assert.deepEqual([odd[1], odd[4]], ['ALARM not a text later: not a text', '–']);
  assert.deepEqual((await cells(page, 'odd-2'))[1], 'ALARM status not readable');
  assert.deepEqual((await cells(page, 'odd-3')).slice(1, 2), ['nothing']);
  assert.match((await cells(page, 'odd-4'))[1], /ALARM alarm 4 and 995 more alarms$/);
}

async function check_search(page) {
  await page.fill('#lab-filter', 'MOUNT wool');
  assert.deepEqual(await names(page), ['x-soon']);
  await says(page, '#lab-found', /^1 of 100 shown$/);
  await page.fill('#lab-filter', 'emergency');
  assert.deepEqual(await names(page), ['z-alarm']);
  await page.fill('#lab-filter', '');
  assert.equal((await names(page)).length, 100);
}

/** A focused link keeps the focus when its row changes and moves; a rig that is not seen is marked. */
async function check_changes(page, server) {
  await page.focus(`${row('y-open')} a`);
  server.sql(published([{ name: 'y-open', bench: 'simulated', state: 'latched', status: { http: 'http://bench8.example:8080/', alarms: ['halted, needs a reset'] } }]));
  server.sql(`UPDATE weft.rig SET seen_at = clock_timestamp() - interval '5 min' WHERE name = 'rig 3'`);
  await says(page, row('y-open'), /halted, needs a reset/);
  await says(page, row('rig 3'), /not seen for 5 min.*as last reported/);
  await says(page, '#lab-count', /7 with an alarm, 1 not seen$/);
  assert.equal((await names(page))[5], 'y-open');
  assert.equal(await page.evaluate(() => document.activeElement.closest('tr')?.dataset.rig), 'y-open');
  server.sql(`DELETE FROM weft.rig WHERE name = 'rig 5'`);
  await says(page, '#lab-count', /^99 rigs/);
  assert.equal(await page.locator(row('rig 5')).count(), 0);
}

/** The daemon's own rig, as it publishes itself: an operator step, then a halt. */
async function check_own_rig(page, daemon) {
  daemon.weft('start', 'people');
  await says(page, row('bench17'), /now, since .*: Mount denim, smooth it, close the clamps/);
  const [, , , run] = await cells(page, 'bench17');
  assert.equal(run, 'R-000001 people awaiting operator 0 of 2 trials');
  assert.equal(await page.getAttribute(row('bench17'), 'class'), 'lab-open');
  daemon.weft('halt');
  await says(page, row('bench17'), /ALARM halted, needs a reset/);
  assert.equal(await page.getAttribute(row('bench17'), 'class'), 'lab-alarm');
}

/** Links lead to http and https only, and never to the reader's machine instead of the rig's. */
async function check_links(page) {
  const links = (here) => page.evaluate(async (host) => {
    const { page_of } = await import('/js/lab_view.js');
    return ['https://b.example', 'http://127.0.0.1:1/', 'http://localhost:1/', 'http://[::1]:1/', 'ftp://b.example', 'javascript:alert(1)', ' JaVaScript:alert(1)', '//b.example',
      'https://ada@b.example', 'https://:x@b.example', '', null, 7].map((value) => page_of(value, host));
  }, here);
  const refused = Array(9).fill(null);
  assert.deepEqual(await links('b.example'), ['https://b.example/', 'own machine', 'own machine', 'own machine', ...refused]);
  assert.deepEqual(await links('localhost'), ['https://b.example/', 'http://127.0.0.1:1/', 'http://localhost:1/', 'http://[::1]:1/', ...refused]);
}

/** The page reads the rigs only while the view is visible. */
async function check_asks(page) {
  let asks = 0;
  page.on('request', (request) => { if (/"lab\.rigs"/.test(request.postData() ?? '')) ++asks; });
  await page.waitForTimeout(5000);
  assert.ok(asks >= 2 && asks <= most_asks, `${asks} reads in 5 s`);
  await see(page, 'live');
  await page.waitForTimeout(300);
  asks = 0;
  await page.waitForTimeout(5000);
  assert.equal(asks, 0, 'reads while the view is hidden');
}

async function check_loss(page, server) {
  await see(page, 'lab');
  await says(page, '#lab-read', /^Store connected, read at/);
  await server.order('stop');
  await says(page, '#lab-trouble', /^The store cannot be read: .* as of/);
  assert.equal(await page.locator('#view-lab[data-old]').count(), 1);
  assert.equal((await names(page)).length, 99, 'the last known rigs stay');
  await judge(page, 'laboratory without its store');
  await server.order('start');
  await says(page, '#lab-read', /^Store connected/);
  assert.equal(await page.textContent('#lab-trouble'), '');
  await page.route('**/rpc', (route) => (/"lab\.rigs"/.test(route.request().postData()) ? route.abort() : route.continue()));
  await says(page, '#lab-trouble', /^The daemon does not answer: .* as of/);
}

/** From the click to 100 rows [ms], in the page. */
const time_to_show = (page, count) => page.evaluate((wanted) => new Promise((done) => {
  const begun = performance.now();
  const look = () => (document.querySelectorAll('#lab-list tbody tr').length >= wanted ? requestAnimationFrame(() => done(performance.now() - begun)) : requestAnimationFrame(look));
  location.hash = '#lab';
  look();
}), count);

/** Without the hostile rigs. */
async function picture(page, name) {
  if (!process.env.WEFT_PICTURES) return;
  await page.$$eval('[data-rig^=odd], [data-rig^="<"]', (rows) => rows.forEach((line) => { line.style.display = 'none'; }));
  await page.screenshot({ path: join(process.env.WEFT_PICTURES, `${name}.png`) });
}

await with_daemon(async (daemon, open) => {
  const page = await open(daemon.link());
  await connected(page);
  await page.evaluate(() => { location.hash = '#lab'; });
  await page.waitForFunction(() => document.querySelector('#view-lab').hidden);
  assert.equal(await page.isVisible('#view-live'), true, 'without a laboratory the view is not shown');
  assert.equal(await page.isVisible('#lab-link'), false);
});

const server = await begin_server();
try {
  execFileSync(WEFT, ['lab', 'install', '--lab', server.uri('admin')]);
  const rigs = [...special_rigs(), ...plain_rigs(89)];
  server.sql(`CREATE ROLE bench LOGIN; GRANT weft_rig TO bench;\n${inserted(rigs.map(({ name }) => name))}\n`);
  await with_daemon(async (daemon, open) => {
    const link = daemon.link(daemon.http, '--role', 'observer', '--name', 'eve');
    server.sql(published(rigs));
    const page = await open(link, { viewport: { ...desktop, width: 1280 } });
    await connected(page);
    await says(page, '#who', /observer/);
    await page.waitForSelector('#lab-link:not([hidden])');
    const first_ms = await time_to_show(page, 100);
    await check_order(page);
    await check_values(page, rigs);
    await check_hostile(page);
    await check_search(page);
    await see(page, 'live');
    const again_ms = await time_to_show(page, 100);
    console.log(`100 rigs shown ${Math.round(first_ms)} ms after the click, again after ${Math.round(again_ms)} ms (SIMULATED)`);
    for (const colorScheme of ['light', 'dark']) {
      for (const viewport of [{ ...desktop, width: 1280 }, narrow]) {
        server.sql(published(rigs));
        const other = await open(link, { viewport, colorScheme });
        await connected(other);
        await see(other, 'lab');
        await other.waitForSelector(row('rig 89'));
        await judge(other, `laboratory, ${colorScheme}, ${viewport.width} px`);
        await picture(other, `lab-${colorScheme}-${viewport.width}`);
        await other.context().close();
      }
    }
    server.sql(published(rigs));
    await check_links(page);
    await check_own_rig(page, daemon);
    server.sql(published(rigs));
    await check_changes(page, server);
    await check_asks(page);
    await check_loss(page, server);
  }, '--lab', server.uri('bench'));
} finally {
  await server.close();
  await (await open_browser()).close();
}
