// Accessibility: no view has a serious or critical finding of axe, by day or night, on a desk or a phone. No view scrolls sideways on a phone. A
// campaign is started by keys alone. SIMULATED.
import assert from 'node:assert/strict';
import { connected, desktop, judge, phone, says, see, with_daemon } from './support.mjs';

const views = ['live', 'start', 'edit/small', 'queue', 'archive', 'run/R-000001/overview', 'run/R-000001/report', 'run/R-000001/trials', 'log'];

/** Puts content into a view. */
async function fill(page, view) {
  if (view.includes('/')) await page.evaluate((address) => { location.hash = address; }, `#${view}`);
  else await see(page, view);
  if (view === 'start') {
    await page.check('input[value=broken]');
    await says(page, '#checked', /Problems/);
    await page.check('input[value=small]');
    await page.waitForSelector('#checked .verdict.good');
  }
  if (view === 'archive') {
    await says(page, '#archive-list', /M1 \d+\.\d %/);
  }
  if (view === 'run/R-000001/overview') await page.waitForSelector('#run-body table.confusion');
  if (view === 'run/R-000001/report') await page.waitForSelector('#run-body .report');
  if (view === 'run/R-000001/trials') {
    await page.click('#run-body table button >> nth=0');
    await says(page, '#run-body', /Taxels/);
  }
  if (view === 'edit/small') await page.waitForSelector('#edit-checked .verdict.good');
  if (view === 'log') await says(page, '#log-lines', /daemon\.started/);
}

async function by_keys_alone(daemon, page) {
  await page.keyboard.press('Tab');
  await page.keyboard.press('Enter'); // the first stop: "to the content"
  assert.equal(await page.evaluate(() => document.activeElement.id), 'main');
  await go_to(page, (focused) => focused.getAttribute('href') === '#start', 'Shift+Tab');
  await page.keyboard.press('Enter');
  await go_to(page, (focused) => focused.name === 'recipe');
  while ((await page.evaluate(() => document.activeElement.value)) !== 'people') await page.keyboard.press('ArrowDown');
  await page.waitForSelector('#checked .verdict.good');
  await go_to(page, (focused) => focused.innerText === 'Start');
  await page.keyboard.press('Enter');
  await says(page, '#asked-step', /Mount denim/);
  assert.equal(daemon.runs.at(-1).recipe, 'people');
}

async function go_to(page, found, key = 'Tab') {
  for (let at = 0; at < 60; ++at) {
    await page.keyboard.press(key);
    if (await page.evaluate(`(${found})(document.activeElement)`)) return;
  }
  assert.fail(`no key leads to ${found}`);
}

await with_daemon(async (daemon, open) => {
  daemon.weft('start', 'small', '--wait');
  const link = daemon.link();
  const signed_out = await open(link.replace(/#.*/, ''));
  await signed_out.waitForSelector('dialog[open]');
  await judge(signed_out, 'sign-in');

  for (const colorScheme of ['light', 'dark']) {
    for (const viewport of [desktop, phone]) {
      const page = await open(link, { viewport, colorScheme });
      await connected(page);
      for (const view of views) {
        await fill(page, view);
        await judge(page, `${view}, ${colorScheme}, ${viewport.width} px`);
      }
      await page.context().close();
    }
  }

  const page = await open(link);
  await connected(page);
  await by_keys_alone(daemon, page);
  await judge(page, 'a person is asked');
  await page.keyboard.press('F8');
  await says(page, '#latched', /HALTED/);
  await judge(page, 'halted');
  await page.click('#latched button');
  await judge(page, 'the question before a reset');
});
