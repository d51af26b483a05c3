// A report of a run within the page: the file's own markup and style sheets, isolated from the page in a shadow root.
// Its bytes are requested with the token, like any file; nothing in it runs.
import { el } from './dom.js';

const never = 'script, style, link, iframe, object, embed, base, meta, form';

/** Shows `html` in `box`. */
export function show_report(box, html) {
  const styles = []; // removed before parsing: the page's policy refuses them as elements
  const bare = html.replace(/<style[^>]*>(?:<!\[CDATA\[)?([\s\S]*?)(?:\]\]>)?<\/style>/g, (_, text) => { styles.push(text); return ''; });
  const read = new DOMParser().parseFromString(bare, 'text/html');
  for (const unwanted of read.querySelectorAll(never)) unwanted.remove();
  for (const link of read.querySelectorAll('a:not([href^="#"])')) link.removeAttribute('href'); // the tab stays on the page
  const host = el('div', { class: 'report', tabindex: '0', role: 'region', 'aria-label': read.title || 'Report' });
  const root = host.attachShadow({ mode: 'open' });
  root.adoptedStyleSheets = styles.map((text) => {
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(text.replaceAll(':root', ':host').replace(/\bbody\s*\{/g, '.report-body{'));
    return sheet;
  });
  const body = el('div', { class: 'report-body' });
  body.append(...document.importNode(read.body, true).childNodes);
  root.append(body);
  // a link to a section of the report is not a view of the page
  root.addEventListener('click', (event) => {
    const link = event.target.closest?.('a[href^="#"]');
    if (!link) return;
    event.preventDefault();
    root.getElementById(link.getAttribute('href').slice(1))?.scrollIntoView();
  });
  box.replaceChildren(el('div', { class: 'contained' }, host)); // the report cannot draw outside of its box, so nothing covers HALT
}
