// The daemon dies under an open page and comes back. The page does not show old data as live and needs no reload. The interrupted run is resumed from
// it. SIMULATED.
import assert from 'node:assert/strict';
import { connected, patience_ms, says, set_pace, start, with_daemon } from './support.mjs';

await with_daemon(async (daemon, open) => {
  const page = await open(daemon.link());
  await connected(page);
  const loads = [];
  page.on('framenavigated', (frame) => loads.push(frame.url().replace(/#.*/, '')));
  await start(page, 'small');
  await says(page, '#run-step', /sliding/);

  await daemon.end('SIGKILL');
  await says(page, '#connection-text', /not connected: stale since \d\d:\d\d:\d\d/, 20000);
  assert.equal(await page.isVisible('#stale'), true);
  assert.equal(await page.locator('#run-orders button:not(:disabled)').count(), 0, 'no order is offered');
  assert.equal(await page.evaluate(() => getComputedStyle(document.querySelector('#pads')).filter), 'grayscale(1)');
  await page.click('#halt');
  await says(page, '#halt-state', /NOT HALTED/);

  await daemon.begin('--pace', '15');
  await connected(page);
  assert.equal(await page.isVisible('#stale'), false);
  await says(page, '#interrupted', /R-000001.*small/);
  await page.click('#interrupted [data-key="R-000001-resume"]');
  await says(page, 'dialog[open]', /R-000001: Resume/);
  assert.ok(await page.locator('dialog[open] li').count() > 0, 'the preview is shown first');
  await page.click('dialog[open] button[type=submit]');
  await says(page, '#run-state', /arming|running/);
  await set_pace(page, 0);
  await says(page, '#run-facts', /outcome\s*complete/, 3 * patience_ms);
  assert.deepEqual(new Set(loads).size <= 1 && loads.every((url) => url.startsWith(`http://127.0.0.1:${daemon.http}/`)), true);
  assert.equal(await page.evaluate(() => performance.getEntriesByType('navigation').length), 1, 'never loaded again');
}, '--pace', '15');
