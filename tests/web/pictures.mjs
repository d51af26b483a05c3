// The pictures of the page in docs/img: a campaign under way on the simulated bench, on a desk by day and on a phone by night.
import { join } from 'node:path';
import { ROOT, connected, phone, says, start, with_daemon } from './support.mjs';

await with_daemon(async (daemon, open) => {
  daemon.weft('start', 'small', '--wait');
  const page = await open(daemon.link());
  const other = await open(daemon.link(), { viewport: phone, colorScheme: 'dark' });
  await connected(page);
  await connected(other);
  daemon.call('sim.clock', { pace: 4 });
  await start(page, 'small');
  await says(page, '#run-where', /trial 2/);
  await says(page, '#run-step', /sliding/);
  await says(page, '#probe-place', /v [89]\d\./);
  await page.waitForFunction(() => document.querySelector('#notes').childElementCount === 0);
  await page.screenshot({ path: join(ROOT, 'docs/img/page-desktop.png') });
  await other.screenshot({ path: join(ROOT, 'docs/img/page-phone.png') });
}, '--pace', '0');
