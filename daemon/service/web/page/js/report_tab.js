// A report of a run within the page: the file's own markup and style sheets, apart from the page's in a shadow root. Its
// bytes come with the token, like any file; nothing in it runs.
import { el } from './dom.js';

const never = 'script, link, iframe, object, embed, base, meta, form';

/** Shows `html` in `box`. */
export function show_report(box, html) {
  const read = new DOMParser().parseFromString(html, 'text/html');
  for (const unwanted of read.querySelectorAll(never)) unwanted.remove();
  const host = el('div', { class: 'report', tabindex: '0', role: 'region', 'aria-label': read.title || 'Report' });
  const root = host.attachShadow({ mode: 'open' });
  root.adoptedStyleSheets = [...read.querySelectorAll('style')].map((style) => {
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(style.textContent.replaceAll(':root', ':host').replace(/\bbody\s*\{/g, '.report-body{'));
    return sheet;
  });
  for (const style of read.querySelectorAll('style')) style.remove();
  const body = el('div', { class: 'report-body' });
  body.append(...document.importNode(read.body, true).childNodes);
  root.append(body);
  // a link to a section of the report is no view of the page
  root.addEventListener('click', (event) => {
    const link = event.target.closest?.('a[href^="#"]');
    if (!link) return;
    event.preventDefault();
    root.getElementById(link.getAttribute('href').slice(1))?.scrollIntoView();
  });
  box.replaceChildren(host);
}
