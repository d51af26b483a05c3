// Operator steps are shown on the page and confirmed there: once by mouse, once by keys. SIMULATED.
import assert from 'node:assert/strict';
import { connected, says, see, start, with_daemon } from './support.mjs';

await with_daemon(async (daemon, open) => {
  const page = await open(daemon.link());
  await connected(page);
  await see(page, 'start');
  await page.check('input[value=people]');
  await says(page, '#checked', /operator\s*2 steps, 2 min.*Mount denim/);
  await start(page, 'people');
  await says(page, '#asked-step', /Mount denim, smooth it/);
  await says(page, '#run-attention', /^now: Mount denim/);
  assert.equal(daemon.runs[0].state, 'awaiting_operator');
  await page.click('#asked-step button');
  await says(page, '#asked-step', /Mount silk/);
  await page.focus('#asked-step button');
  await page.keyboard.press('Enter');
  await says(page, '#run-facts', /outcome\s*complete/);
  assert.equal(await page.isHidden('#asked-step'), true);

  const watcher = await open(daemon.link(daemon.http, '--name', 'watcher', '--role', 'observer'));
  await connected(watcher);
  await start_is_not_offered(watcher);
  await watcher.click('#halt');
  await says(watcher, '#latched', /HALTED.*watcher/);
  await says(page, '#latched', /HALTED.*watcher/);
});

/** An observer may halt and do nothing else. */
async function start_is_not_offered(page) {
  await see(page, 'start');
  await page.check('input[value=small]');
  await page.waitForSelector('#checked .verdict.good');
  assert.equal(await page.isDisabled('#start-buttons [data-key=start]'), true);
  await page.waitForSelector('#lease[data-control]');
  assert.equal(await page.locator('#lease button').count(), 0);
}
