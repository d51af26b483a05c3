// The page of rigs that differ from the 5-DoF bench shows only the parts that the rig has. SIMULATED.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { Daemon, ROOT, WEFT, connected, open_browser, open_page, recipe, says } from './support.mjs';

/**
 * Rig files of sim/rigs, and shapes of `weft init`: axes with a stage; whether forces are measured; number of pads; columns and rows of their
 * picture.
 */
const rigs = {
  'emulated-xyz': { axes: ['x', 'y', 'z'], wrench: false, pads: 16, wide: 4, high: 4 },
  'emulated-xz': { axes: ['x', 'z'], wrench: true, pads: 16, wide: 4, high: 4 },
  'emulated-digital': { axes: ['x', 'y', 'z'], wrench: true, pads: 16, wide: 4, high: 4 },
  'emulated-taxels32': { axes: ['x', 'y', 'z'], wrench: true, pads: 32, wide: 8, high: 4 },
  'two-arrays': { axes: ['x', 'y', 'z'], wrench: true, pads: 22, wide: 4 + 0.5 + 3, high: 4 },
};

function small(of) {
  const along = of.axes.includes('y') ? { dx_mm: 0, dy_mm: 20 } : { dx_mm: 20, dy_mm: 0 };
  const press = of.wrench ? { force_N: 5 } : { press_depth_mm: 1.6 };
  return recipe({ name: 'small', fabrics: ['denim', 'silk'], repetitions: 1, explorations: { M1: { phases: [
    { phase: 'S', duration_s: 1 }, { phase: 'P', duration_s: 2, ...press },
    { phase: 'M', speed_mm_s: 2, path: [along] }, { phase: 'E', duration_s: 1 }] } } });
}

/** Whether the picture is painted at each pad's place; and its alpha in the gap and outside, where no pad is. */
const painted = (page, { wide, high }) => page.evaluate(([columns, rows]) => {
  const canvas = document.querySelector('#pads');
  const size = Math.min(canvas.width / columns, canvas.height / rows);
  const left = (canvas.width - size * columns) / 2;
  const context = canvas.getContext('2d');
  const alpha = (x, y) => context.getImageData(left + x * size, y * size, 1, 1).data[3];
  const filled = [];
  for (let row = 0; row < rows; ++row) for (let column = 0; column < Math.floor(columns); ++column) filled.push(alpha(column + 0.2, row + 0.2) > 0);
  return { filled, gap: columns % 1 === 0 ? null : alpha(4.25, 0.5), outside: alpha(-0.3, 0.5) };
}, [wide, high]);

/** A rig file of sim/rigs without its ports, in virtual time. */
function without_ports(name) {
  const rig = JSON.parse(readFileSync(join(ROOT, 'sim/rigs', `${name}.json`), 'utf8'));
  rig.bench = 'simulated';
  for (const device of rig.devices) device.link = { kind: 'memory' };
  delete rig.simulation.console;
  for (const table of ['fabrics', 'fidelity']) rig.simulation[table] = join(ROOT, 'sim', `${table}.json`);
  return JSON.stringify(rig);
}

async function look_at(name, of) {
  const daemon = new Daemon();
  try {
    daemon.rig = join(daemon.folder, `${name}.json`);
    if (name.startsWith('emulated-')) writeFileSync(daemon.rig, without_ports(name));
    else execFileSync(WEFT, ['init', daemon.rig, '--simulated', name], { cwd: ROOT });
    writeFileSync(join(daemon.folder, 'recipes', 'small.json'), JSON.stringify(small(of)));
    mkdirSync(join(daemon.folder, 'data'), { recursive: true });
    await daemon.begin('--pace', '4');
    const page = await open_page(daemon.link());
    await connected(page);
    await says(page, '#rig-name', new RegExp(`^${name}$`));
    daemon.weft('start', 'small');
    await says(page, '#run-step', /sliding/);
    await says(page, '#pads-range', /0 to \d+ counts .*phase S/);
    const label = await page.getAttribute('#pads', 'aria-label');
    assert.match(label, new RegExp(`\\b${of.pads} taxels,`), name);
    assert.equal(label.split(', ').length - 1, of.pads, name);
    const { filled, gap, outside } = await painted(page, of);
    if (of.wide % 1 === 0) assert.ok(filled.length === of.pads && filled.every(Boolean), `${name}: ${filled}`);
    else assert.deepEqual([filled.slice(0, 4), gap], [[true, true, true, true], 0], `${name}: two arrays with a gap between them`);
    assert.equal(outside, 0, name);
    const keys = await page.$$eval('#chart-stages-key li', (items) => items.filter((item) => !item.hidden).map((item) => item.innerText.trim()[0]));
    assert.deepEqual(keys, of.axes, name);
    for (const chart of ['#chart-force', '#chart-torque']) assert.equal(await page.isVisible(chart), of.wrench, `${name}: ${chart}`);
    if (of.wrench) await says(page, '#chart-force-key li:nth-child(1)', /Fz\s*−?[45]\.\d\d N/);
    await says(page, '#probe-place', /u \d+\.\d\d, v \d+\.\d\d, height −?\d+\.\d\d mm/);
    assert.deepEqual(page.troubles, [], name);
    if (process.env.WEFT_PICTURES) await page.screenshot({ path: join(process.env.WEFT_PICTURES, `${name}.png`) });
  } finally {
    await daemon.close();
  }
}

for (const [name, of] of Object.entries(rigs)) await look_at(name, of);
await (await open_browser()).close();
