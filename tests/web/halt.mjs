// The halt in its hardest cases. First with an open question, by key and by button. Then from the visible one of seven pages in one browser, which
// has only six connections for one host. SIMULATED.
import assert from 'node:assert/strict';
import { connected, open_browser, patience_ms, says, start, with_daemon } from './support.mjs';

async function reset(daemon, page) {
  await says(page, '#rig-fact', /latched/);
  assert.equal(daemon.call('rig.state').rig, 'latched');
  daemon.call('rig.reset', { reason: 'a test has looked at it' });
  await says(page, '#rig-fact', /holding/); // it was halted over the fabric, and then inspected
}

/** `act` halts while the abort question is open, which no one answers. */
async function halt_in_a_question(daemon, page, act) {
  await start(page, 'small');
  await says(page, '#run-state', /running/);
  await page.click('#run-orders button:has-text("Abort")');
  await page.waitForSelector('dialog[open]');
  await act();
  await reset(daemon, page);
  const [last] = daemon.runs.slice(-1);
  assert.deepEqual([last.outcome, last.cleanup], ['aborted', 'skipped'], 'halted, and not aborted, which cleans up');
}

/** Playwright treats all its pages as visible: this lets a test hide one. */
async function can_be_hidden(page) {
  await page.addInitScript(() => {
    let hidden = false;
    Object.defineProperty(document, 'hidden', { get: () => hidden });
    globalThis.hide = () => { hidden = true; document.dispatchEvent(new Event('visibilitychange')); };
  });
}

/** All pages in one browser context, so that they share its connections. */
async function seven_pages(daemon) {
  const context = await (await open_browser()).newContext();
  const link = daemon.link();
  for (let at = 0; at < 6; ++at) {
    const page = await context.newPage();
    await can_be_hidden(page);
    await page.goto(link);
    await connected(page);
    await page.evaluate(() => globalThis.hide());
    await says(page, '#connection-text', /not connected/);
  }
  const seen = await context.newPage();
  seen.setDefaultTimeout(patience_ms);
  await seen.goto(link);
  await connected(seen);
  await seen.click('#halt');
  await reset(daemon, seen);
  assert.equal(await seen.textContent('#halt-state'), '');
  assert.equal(await seen.locator('#troubles .note').count(), 0, 'it arrived');
  await context.close();
}

await with_daemon(async (daemon, open) => {
  const page = await open(daemon.link());
  await connected(page);
  await halt_in_a_question(daemon, page, () => page.click('dialog[open] .halt-here'));
  assert.equal(await page.locator('dialog[open]').count(), 0);
  await halt_in_a_question(daemon, page, () => page.keyboard.press('F8'));
  await page.keyboard.press('Escape'); // F8 does not answer the question: the user who opened it closes it
  assert.equal(await page.locator('dialog[open]').count(), 0);
  assert.equal(daemon.runs.length, 2);
  await seven_pages(daemon);
}, '--pace', '5');
