// Pictures of every kind of report: no text overlaps another or leaves its picture, at both sizes, light and dark. Pages are not too tall,
// and no picture is cut on A4. weft report --from must draw each page again from its record, to the same bytes.
//   figures.mjs REPORT_PAGES SOURCE_ROOT WEFT
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, readdirSync, rmSync, statSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { chromium } from 'playwright-core';

const [MAKE, ROOT, WEFT] = process.argv.slice(2);
const slack_px = 1;
const most_px = { campaign: 6000, campaign_imprints: 8000, imprints: 8000 }; // at a width of 1440 px, with 17 classes
const most_bytes = { campaign: 300000 };

/** Runs in the page: sentences about texts that overlap or leave their picture. */
function troubles(slack) {
  const out = [];
  const open = document.querySelectorAll('details');
  for (const one of open) one.open = true;
  for (const svg of document.querySelectorAll('svg')) {
    const picture = svg.getBoundingClientRect();
    const name = svg.querySelector('title')?.textContent;
    const boxes = [...svg.querySelectorAll('text')].map((text) => [text.lastChild.textContent, text.getBoundingClientRect()]);
    for (const [text, box] of boxes)
      if (box.left < picture.left - slack || box.top < picture.top - slack || box.right > picture.right + slack || box.bottom > picture.bottom + slack)
        out.push(`"${text}" leaves "${name}"`);
    for (let i = 0; i < boxes.length; i += 1)
      for (let k = i + 1; k < boxes.length; k += 1) {
        const [a, b] = [boxes[i][1], boxes[k][1]];
        if (a.left < b.right - slack && b.left < a.right - slack && a.top < b.bottom - slack && b.top < a.bottom - slack)
          out.push(`"${boxes[i][0]}" overlaps "${boxes[k][0]}" in "${name}"`);
      }
  }
  return out;
}

/** Runs in the page: pictures that are wider than the printed page. */
function cut_in_print(slack) {
  const right = document.documentElement.clientWidth;
  const wide = (one) => one.getBoundingClientRect().right > Math.min(right, one.closest('figure')?.getBoundingClientRect().right ?? right) + slack;
  return [...document.querySelectorAll('svg')].filter(wide).map((one) => `"${one.querySelector('title')?.textContent}" is cut in print`);
}

const a4_px = 688; // 210 mm minus two margins of 14 mm
const folder = mkdtempSync(join(tmpdir(), 'weft-figures-'));
const browser = await chromium.launch({ executablePath: '/usr/bin/chromium', args: ['--no-sandbox'] });
try {
  execFileSync(MAKE, [folder, ROOT], { stdio: 'inherit' });
  const files = readdirSync(folder).filter((file) => file.endsWith('.html'));
  assert.equal(files.length, 52);
  const again = join(folder, 'again.html');
  for (const file of files) {
    execFileSync(WEFT, ['report', '--from', join(folder, file.replace('.html', '.json')), '-o', again]);
    assert.ok(readFileSync(again).equals(readFileSync(join(folder, file))), `${file} is drawn otherwise from its record`);
  }
  let texts = 0;
  const found = [];
  for (const [width, colorScheme] of [[1440, 'light'], [1440, 'dark'], [390, 'light'], [390, 'dark']]) {
    const page = await (await browser.newContext({ viewport: { width, height: 900 }, colorScheme })).newPage();
    for (const file of files) {
      await page.goto(`file://${join(folder, file)}`);
      const [kind, classes] = file.replace('.html', '').split('-');
      const height = await page.evaluate(() => document.documentElement.scrollHeight);
      if (width === 1440 && Number(classes) <= 17 && most_px[kind] < height) found.push(`${file} is ${height} px tall`);
      const bytes = statSync(join(folder, file)).size;
      if (Number(classes) <= 17 && most_bytes[kind] < bytes) found.push(`${file} has ${bytes} bytes`);
      const wide = await page.evaluate(() => document.documentElement.scrollWidth);
      if (wide > width) found.push(`${file} is ${wide} px wide on ${width}`);
      texts += await page.evaluate(() => document.querySelectorAll('svg text').length);
      for (const trouble of await page.evaluate(troubles, slack_px)) found.push(`${file}, ${width} px, ${colorScheme}: ${trouble}`);
    }
  }
  const paper = await (await browser.newContext({ viewport: { width: a4_px, height: 1000 } })).newPage();
  await paper.emulateMedia({ media: 'print' });
  for (const file of files) {
    await paper.goto(`file://${join(folder, file)}`);
    for (const trouble of await paper.evaluate(cut_in_print, slack_px)) found.push(`${file}: ${trouble}`);
  }
  assert.ok(texts > 4000, `${texts} texts`);
  assert.deepEqual(found.slice(0, 40), [], `${found.length} troubles`);
} finally {
  await browser.close();
  rmSync(folder, { recursive: true, force: true });
}
