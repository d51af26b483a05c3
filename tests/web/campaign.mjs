// The page checks, starts, shows, pauses, resumes and halts a campaign and resets the rig. Another campaign is completed and its result looked up.
// SIMULATED.
import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { readFileSync } from 'node:fs';
import { connected, patience_ms, says, see, set_pace, start, with_daemon } from './support.mjs';

const orders = (page, text) => page.click(`#run-orders button:has-text("${text}")`);

async function check_before_anything_moves(daemon, page) {
  await see(page, 'start');
  await page.check('input[value=broken]');
  await says(page, '#checked .problem:not(.verdict)', /\/fabrics\/1.*tweed/);
  assert.equal(await page.isDisabled('#start-buttons [data-key=start]'), true);
  await page.check('input[value=small]');
  await says(page, '#checked', /duration.*min.*8: 2 fabrics.*MB.*not needed/);
  await says(page, '#checked', /M: motion 25.* s, 5 ± 0.25 N at 2 mm\/s/);
  assert.deepEqual(daemon.runs, [], 'a question starts nothing');
}

/** Force on the fabric, pads with counts and the place of the probe, as the daemon reports them. */
async function watch(page) {
  await says(page, '#rig-fact', /moving/);
  await says(page, '#run-count', /of 8 trials/);
  await says(page, '#run-where', /denim · M1 · repetition 1 · trial 1/);
  await says(page, '#chart-force-key li:nth-child(1)', /Fz\s*−?[45]\.\d\d N/);
  await says(page, '#chart-stages-key li:nth-child(3)', /z\s*\d+\.\d\d mm/);
  await says(page, '#pads-range', /\d+ to \d+ counts/);
  await says(page, '#probe-place', /u 7\d\.\d\d, v \d+\.\d\d, height −?\d+\.\d\d mm/);
  await says(page, '#run-step', /sliding/);
  await says(page, '#run-left', /left, ends/);
  assert.match(await page.getAttribute('#pads', 'aria-label'), /16 taxels, .*: (-?\d+, ){15}-?\d+/);
  const drawn = await page.evaluate(() => [...document.querySelectorAll('.plot canvas')].map((canvas) => {
    const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    return data.some((value) => value !== 0);
  }));
  assert.ok(drawn.length >= 3 && drawn.includes(true), 'charts have lines');
}

async function halt_and_reset(daemon, page) {
  await page.keyboard.press('F8');
  await says(page, '#latched', /HALTED/);
  await says(page, '#rig-fact', /latched/);
  assert.equal(daemon.call('rig.state').rig, 'latched');
  await says(page, '#run-facts', /outcome\s*aborted.*cleanup\s*skipped/);
  await page.click('#latched button');
  await page.fill('dialog[open] input', 'looked at it: nothing is touched');
  await page.click('dialog[open] button[type=submit]');
  await says(page, '#rig-fact', /holding/);
  assert.deepEqual([daemon.call('rig.state').rig, daemon.call('rig.state').acknowledged], ['holding', true]);
}

async function look_it_up(page) {
  await see(page, 'archive');
  await page.click('#archive-list a >> nth=0');
  await says(page, '#run-head', /SIMULATED.*M1: accuracy \d+\.\d %/);
  await says(page, '#run-body', /outcome\s*complete/);
  assert.equal(await page.locator('#run-body table.confusion tbody tr').count(), 2);
  await page.click('#run-tabs a:has-text("Files")');
  await says(page, '#run-body', /certificate\.json.*dataset\.h5.*evaluation\.json/);
  const [download] = await Promise.all([page.waitForEvent('download'), page.click('#run-body button:has-text("certificate.json")')]);
  const digest = createHash('sha256').update(readFileSync(await download.path())).digest('hex');
  const listed = await page.locator('#run-body tr:has-text("certificate.json") code').textContent();
  assert.ok(digest.startsWith(listed), 'the bytes that are listed');
  await page.click('#run-tabs a:has-text("Overview")');
  await page.click('#run-body button:has-text("Verify")');
  await says(page, '#notes', /verified/);
  await see(page, 'log');
  await says(page, '#log-lines', /token\.added/);
}

await with_daemon(async (daemon, open) => {
  const page = await open(daemon.link());
  await connected(page);
  assert.ok(!page.url().includes('wft_'), 'the token has left the address bar');
  await says(page, '#simulated-kind', /^SIMULATED$/);
  await check_before_anything_moves(daemon, page);

  await start(page, 'small');
  await page.waitForSelector('#lease[data-control=mine]');
  await watch(page);
  await orders(page, 'Pause now');
  await says(page, '#run-state', /held/);
  await says(page, '#rig-fact', /holding/);
  await orders(page, 'Resume');
  await says(page, '#run-state', /running/);
  await page.click('#run-orders button:has-text("Pause"):not(:has-text("now"))');
  await says(page, '#run-state', /pausing|held/);
  await says(page, '#run-state', /held/);
  await orders(page, 'Resume');
  await says(page, '#run-state', /running/);
  await halt_and_reset(daemon, page);

  await start(page, 'small');
  await set_pace(page, 0);
  await says(page, '#run-facts', /outcome\s*complete\s*cleanup\s*done\s*rig\s*safe.*evaluation\s*done/, 3 * patience_ms);
  assert.deepEqual(daemon.runs.map((run) => run.outcome), ['aborted', 'complete']);
  await says(page, '#samples-of', /R-00000\d \(ended\)/);
  await look_it_up(page);
  await page.click('#lease button');
  await page.waitForSelector('#lease[data-control=free]');
}, '--pace', '15');
