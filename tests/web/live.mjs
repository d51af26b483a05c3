// Live pictures are true: pads above their rest on a fixed scale; the regulated force with its set point and phases; the last minutes also for a page
// opened later; no line where no data came. SIMULATED.
import assert from 'node:assert/strict';
import { connected, says, start, with_daemon } from './support.mjs';

const pads_now = async (page) => (await page.getAttribute('#pads', 'aria-label')).split(': ')[1].split(', ').map(Number);
const sum = (values) => values.reduce((total, one) => total + one, 0);
const told_of = (page, chart) => page.getAttribute(chart, 'aria-label');

/** Number of pixels of the force chart in the colour of Fz. */
const drawn = (page) => page.evaluate(() => {
  let found = 0;
  for (const canvas of document.querySelectorAll('#chart-force canvas')) {
    const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    for (let at = 0; at < data.length; at += 4) if (data[at] < 20 && Math.abs(data[at + 1] - 114) < 12 && Math.abs(data[at + 2] - 178) < 12 && data[at + 3] > 200) ++found;
  }
  return found;
});

await with_daemon(async (daemon, open) => {
  const page = await open(daemon.link());
  await connected(page);
  await start(page, 'plain');

  // pressed and lifted look different
  await says(page, '#run-step', /sliding/);
  await says(page, '#pads-range', /^0 to 500 counts .*phase S$/);
  const pressed = sum(await pads_now(page));
  assert.ok(pressed > 16 * 100, `pressed: ${pressed} counts above rest`);
  await page.waitForFunction((least) => {
    const values = document.querySelector('#pads').getAttribute('aria-label').split(': ')[1].split(', ').map(Number);
    return Math.abs(values.reduce((total, one) => total + one, 0)) < least;
  }, pressed / 4);
  await page.check('#pads-raw');
  await says(page, '#pads-range', /raw/);
  assert.ok(sum(await pads_now(page)) > 16 * 3000, 'raw counts');
  await page.uncheck('#pads-raw');

  // set point and phases
  await says(page, '#run-step', /sliding/);
  await says(page, '#chart-force-key', /set point 5 ± 0\.25 N/);
  assert.match(await told_of(page, '#chart-force'), /phases S, P, M/);

  // a page opened later has the last minutes
  await page.reload();
  await connected(page);
  await page.waitForFunction(() => / phases S, P, M/.test(document.querySelector('#chart-force').getAttribute('aria-label')));
  assert.ok(await drawn(page) > 300, `the line is there after a reload: ${await drawn(page)} px`);

  // fast: the page requests rows that come too rarely as events, and draws no ramp across a gap
  daemon.call('sim.clock', { pace: 64 });
  await page.waitForFunction(() => {
    const [, rows, gaps, widest_s] = /: (\d+) rows, (\d+) gaps, (\d+\.\d) s/.exec(document.querySelector('#chart-force').getAttribute('aria-label')) ?? [];
    return rows > 400 && gaps < 3 && widest_s > 200;
  });

  // after the end the last picture stays, also for a new page
  daemon.call('sim.clock', { pace: 0 });
  daemon.weft('watch', 'R-000001');
  const late = await open(daemon.link());
  await connected(late);
  await says(late, '#samples-of', /R-000001 \(ended\)/);
  await late.waitForFunction(() => / phases .*M/.test(document.querySelector('#chart-force').getAttribute('aria-label')));
  await says(late, '#pads-range', /phase S/);
}, '--pace', '8');
