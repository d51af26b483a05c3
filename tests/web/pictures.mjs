// Draws the pictures of the page in docs/img: a campaign in progress and its result on the simulated bench, on a desk and a phone, by day and by
// night. `run pictures WEFTD WEFT ROOT`; WEFT_PICTURES names another folder for them. SIMULATED.
import { join } from 'node:path';
import { ROOT, connected, desktop, phone, says, start, with_daemon } from './support.mjs';

const folder = process.env.WEFT_PICTURES ?? join(ROOT, 'docs/img');
const looks = [['desktop', desktop, 'light'], ['desktop-dark', desktop, 'dark'], ['phone', phone, 'light'], ['phone-dark', phone, 'dark']];
const quiet = (page) => page.waitForFunction(() => document.querySelector('#notes').childElementCount === 0);

const take = (page, name) => page.screenshot({ path: join(folder, `${name}.jpg`), type: 'jpeg', quality: 40 });

async function go(page, address, selector, pattern) {
  await page.evaluate((hash) => { location.hash = hash; }, address);
  await says(page, selector, pattern);
}

await with_daemon(async (daemon, open) => {
  daemon.weft('start', 'small', '--wait');
  daemon.call('run.wait', { run: 'R-000001', hand_over: true });
  const pages = [];
  for (const [name, viewport, colorScheme] of looks) pages.push([name, await open(daemon.link(daemon.http, '--role', 'engineer'), { viewport, colorScheme })]);
  for (const [, page] of pages) await connected(page);
  for (const [name, page] of pages) {
    await go(page, '#run/R-000001/matrix', '#run-body table.confusion', /denim/);
    await take(page, `result-${name}`);
    await go(page, '#start', '#recipes', /Does not fit/);
    await page.check('input[value=small]');
    await page.waitForSelector('#checked .verdict.good');
    await take(page, `start-${name}`);
    await go(page, '#edit/small', '#edit-checked .verdict.good', /./);
    await take(page, `edit-${name}`);
    await go(page, '#run/R-000001/trials', '#run-body', /8 attempts/);
    await page.click('#run-body table button >> nth=1');
    await says(page, '#run-body', /Taxels/);
    await take(page, `trials-${name}`);
    await go(page, '#archive', '#archive-list', /R-000001/);
    await take(page, `archive-${name}`);
  }
  daemon.call('sim.clock', { pace: 4 });
  await start(pages[0][1], 'small');
  for (const [, page] of pages.slice(1)) await page.evaluate(() => { location.hash = '#live'; });
  await says(pages[0][1], '#run-where', /trial 2/);
  await says(pages[0][1], '#run-step', /sliding/);
  await says(pages[0][1], '#probe-place', /v [89]\d\./);
  await quiet(pages[0][1]);
  for (const [name, page] of pages) await take(page, `page-${name}`);
}, '--pace', '0');
