// Results are easy to find: a recipe without evaluation settings is evaluated, and the matrix is at most three clicks away. Report, model, trials,
// exports, tags, search and a comparison are in the page. SIMULATED.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { connected, patience_ms, phone, says, see, with_daemon } from './support.mjs';

const lines_of = async (download) => readFileSync(await download.path(), 'utf8').split('\n');

async function exported(page, name) {
  const [download] = await Promise.all([page.waitForEvent('download'), page.click(`#run-body button:text-is("${name}")`)]);
  return download;
}

async function open_tab(page, name, pattern) {
  await page.click(`#run-tabs a:has-text("${name}")`);
  await says(page, '#run-body', pattern);
}

/** Number of clicks from a newly opened page. */
async function count_clicks(page) {
  const clicks = ['nav a[href="#archive"]', '#archive-list a >> nth=0', '#run-tabs a[href$="/matrix"]'];
  for (const click of clicks) await page.click(click);
  await page.waitForSelector('#run-body table.confusion');
  return clicks.length;
}

/** Waits until the confusion matrix has `classes` rows; the page may draw it again while answers arrive. */
const matrix_of = (page, classes) => page.waitForFunction((n) => document.querySelectorAll('#run-body table.confusion tbody tr').length === n, classes);

await with_daemon(async (daemon, open) => {
  daemon.weft('start', 'plain', '--wait');
  daemon.call('run.wait', { run: 'R-000001', hand_over: true });
  const [told] = daemon.call('run.get', { run: 'R-000001' }).result;
  const page = await open(daemon.link());
  await connected(page);
  assert.ok(await count_clicks(page) <= 3);
  await matrix_of(page, 2);
  const right = `${(100 * told.accuracy).toFixed(1)} %`;
  await says(page, '#run-head', new RegExp(`M1: accuracy ${right.replace('.', '\\.')}`));
  await page.focus('#run-body button:has-text("Shares")');
  await page.keyboard.press('Enter');
  assert.equal(await page.evaluate(() => document.activeElement.textContent), 'Shares', 'the keyboard stays on the button');
  await says(page, '#run-body table.confusion', /%/);

  // the same number everywhere
  await see(page, 'archive');
  await says(page, '#archive-list', new RegExp(`M1 ${right.replace('.', '\\.')}`));
  await page.click('#archive-list a >> nth=0');
  await open_tab(page, 'Report', /Download/);
  const report = await page.evaluate(() => document.querySelector('.report').shadowRoot.querySelector('.report-body').innerText);
  assert.ok(report.includes((100 * told.accuracy).toFixed(1)) && report.includes('SIMULATED'), 'the report has the same accuracy');
  const looks = await page.evaluate(() => getComputedStyle(document.querySelector('.report').shadowRoot.querySelector('h1')).fontWeight);
  assert.ok(Number(looks) >= 600, 'the report has its own style');
  await open_tab(page, 'Model', /\.model/);

  // trials
  await open_tab(page, 'Trials', /8 attempts/);
  await page.click('#run-body table button >> nth=3');
  await says(page, '#run-body', /Force \[N\].*Stages.*phase S/);
  assert.equal(await page.locator('.trial-pads rect').count(), 16);

  // exports
  await open_tab(page, 'Files', /Export/);
  const samples = await lines_of(await exported(page, 'samples CSV: wrench'));
  assert.ok(samples.length > 1000 && samples.slice(0, 3).join().toLowerCase().includes('simulated'), samples.slice(0, 3).join());
  assert.equal((await lines_of(await exported(page, 'features CSV'))).filter((line) => /denim|silk/.test(line)).length, 8);
  assert.equal(readFileSync(await (await exported(page, 'HDF5')).path()).subarray(1, 4).toString(), 'HDF');

  // tags, notes, search
  await open_tab(page, 'Overview', /Tags/);
  await page.fill('#run-tags', 'pilot, new sensor');
  await page.fill('#run-note', 'the clamp was loose');
  await page.click('#run-annotate');
  await says(page, '#notes', /Saved/);
  assert.deepEqual(daemon.call('run.get', { run: 'R-000001' }).tags, ['pilot', 'new sensor']);
  daemon.weft('start', 'small', '--wait');
  daemon.call('run.wait', { run: 'R-000002', hand_over: true });
  await see(page, 'archive');
  await says(page, '#archive-list', /R-000002.*R-000001/);
  await page.fill('#archive-filter', 'clamp');
  await says(page, '#archive-list', /1 campaign/);
  await says(page, '#archive-list', /R-000001.*new sensor/);
  await page.fill('#archive-filter', '');
  await says(page, '#archive-list', /R-000002/);

  // paging: the daemon returns one run a request
  const tiny = await open(daemon.link(), { before: (made) => made.route('**/rpc', (route) =>
    route.continue({ postData: route.request().postData().replace('"most":100,', '"most":1,') })) });
  await connected(tiny);
  await see(tiny, 'archive');
  await tiny.click('#archive-list button:text-is("More")');
  await says(tiny, '#archive-list', /R-000002.*R-000001.*2 campaigns/);
  await tiny.waitForSelector('#archive-list button:text-is("More")', { state: 'detached' });

  // evaluate again while a note is being typed
  await page.click('#archive-list a:has-text("R-000001")');
  await says(page, '#run-head', /Evaluate again/);
  await page.waitForSelector('#run-note');
  await page.fill('#run-note', 'the clamp was loose, and the lamp');
  const note_drawn_before = await page.evaluateHandle(() => document.querySelector('#run-note'));
  await page.click('#run-head [data-key=evaluate]');
  await page.click('dialog button:text-is("Evaluate")');
  await page.focus('#run-note');
  daemon.call('run.wait', { run: 'R-000001', hand_over: true });
  await says(page, '#run-head', new RegExp(`M1: accuracy ${right.replace('.', '\\.')}`));
  await page.waitForFunction((old) => document.querySelector('#run-note') !== old, note_drawn_before);
  assert.equal(await page.inputValue('#run-note'), 'the clamp was loose, and the lamp');
  assert.equal(await page.evaluate(() => document.activeElement.id), 'run-note', 'the caret stays');
  await open_tab(page, 'Confusion matrix', /denim/);
  await open_tab(page, 'Overview', /Tags/);
  assert.equal(await page.inputValue('#run-note'), 'the clamp was loose, and the lamp', 'a draft outlives a look elsewhere');
  await see(page, 'archive');

  // comparison of two runs
  for (const run of ['R-000001', 'R-000002']) await page.check(`#archive-list [data-key="tick-${run}"]`);
  await page.click('#archive-compare a');
  await says(page, '#compare-body', /recipe\s*plain\s*small\s*≠ differs/);
  await says(page, '#compare-body', /bench\s*simulated\s*simulated\s*same/);
  assert.equal(await page.locator('#compare-body table.confusion').count(), 2);

  // the tutorial's first campaign: the page needs no other step after its start
  daemon.weft('start', 'first', '--wait');
  daemon.call('run.wait', { run: 'R-000003', hand_over: true });
  const anew = await open(daemon.link());
  await connected(anew);
  assert.ok(await count_clicks(anew) <= 3);
  await says(anew, '#run-head', /R-000003 · first/);
  await matrix_of(anew, 3);

  // on a phone, after the end of the run
  const small = await open(daemon.link(), { viewport: phone, colorScheme: 'dark' });
  await connected(small);
  await small.click('#run-facts a:has-text("Confusion matrix")');
  await small.waitForSelector('#run-body table.confusion');
});
