// Opens the report page of tests/experiments/report_test.cpp from disk in headless Chromium and uses
// it: node report_browser.mjs REPORT.html
// Exit code 0: good; 1: something does not work; 77: no Chromium (set CHROMIUM).
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { browse, check, finish, scriptErrors } from './browser.mjs';

const [page] = process.argv.slice(2);
if (!page) {
  console.error('usage: node report_browser.mjs REPORT.html');
  process.exit(2);
}

// What a user would do, and what is seen then, written into the page for --dump-dom.
const visit = `<script>setTimeout(() => {
  const $ = (s) => [...document.querySelectorAll(s)], seen = {};
  const fire = (e, name, more) => e.dispatchEvent(Object.assign(new Event(name, {bubbles: true}), more));
  const paths = () => $('figure path:not(.raw)').map((p) => p.getAttribute('d'));
  seen.width = [innerWidth, document.documentElement.scrollWidth];
  seen.charts = $('figure').length;
  seen.plain = paths();
  const chart = $('figure')[1], picture = chart.querySelector('svg'), box = picture.getBoundingClientRect();
  fire(picture, 'pointermove', {clientX: box.left + 0.15 * box.width, clientY: box.top + 20});
  seen.tip = chart.querySelector('.tip').innerText;
  const log = document.getElementById('log'), smooth = document.getElementById('smooth');
  log.checked = true; fire(log, 'input'); seen.log = paths();
  log.checked = false; fire(log, 'input');
  smooth.value = 0.9; fire(smooth, 'input'); seen.smooth = paths(); seen.raw = $('figure path.raw').length;
  smooth.value = 0; fire(smooth, 'input');
  const boxes = $('[data-run]');
  boxes[2].checked = false; fire(boxes[2], 'change'); seen.without = paths().length;
  const filter = document.getElementById('filter');
  filter.value = 'MOTION'; fire(filter, 'input'); seen.filtered = $('figure:not([hidden])').length;
  const inside = () => document.getElementById('player').contentDocument.documentElement.dataset;
  seen.player = {...inside()};
  document.getElementById('theme').click();
  seen.themes = [document.documentElement.dataset.theme, inside().theme];
  $('[data-play]')[1].click();
  setTimeout(() => {
    seen.second = document.getElementById('player').contentDocument.title;
    document.body.innerHTML = '<pre id="seen"></pre>';
    document.getElementById('seen').textContent = JSON.stringify(seen);
  }, 800);
}, 800);</script></body>`;

const folder = mkdtempSync(join(tmpdir(), 'restage-report-')), copy = join(folder, 'report.html');
writeFileSync(copy, readFileSync(page, 'utf8').replace('</body>\n</html>\n', () => visit));
for (const [name, size] of [['desktop', '1300,900'], ['telephone', '500,900']]) {
  const dom = browse(copy, 'light', size, '--dump-dom'), errors = scriptErrors(dom);
  check(errors.length === 0, `${name}: no script errors ${errors.slice(0, 3).join(' | ')}`);
  const text = /<pre id="seen">(.*?)<\/pre>/s.exec(dom.stdout)?.[1];
  check(text !== undefined, `${name}: the page was used to the end`);
  if (text === undefined) continue;
  const seen = JSON.parse(text.replaceAll('&lt;', '<').replaceAll('&gt;', '>').replaceAll('&amp;', '&'));
  check(seen.width[1] <= seen.width[0], `${name}: nothing wider than the window (${seen.width})`);
  check(seen.charts === 2 && seen.plain.length === 3 && seen.plain.every((d) => d.startsWith('M')),
        `${name}: ${seen.charts} charts, ${seen.plain.length} curves`);
  check(/^step \d+\n/.test(seen.tip) && seen.tip.includes('one and 1 more') && seen.tip.includes('three </script>'), `${name}: hover says ${JSON.stringify(seen.tip)}`);
  check(seen.log.every((d, k) => d !== seen.plain[k]) && seen.log[0].split('M').length === 3,
        `${name}: a logarithmic axis leaves out what is not above 0`);
  check(seen.smooth[1] !== seen.plain[1] && seen.raw === 3, `${name}: smoothing, with the raw curves behind`);
  check(seen.without === 2 && seen.filtered === 1, `${name}: runs and charts can be left out`);
  check(!!seen.player.ready && seen.player.framed !== undefined, `${name}: the first sequence is drawn (${JSON.stringify(seen.player)})`);
  check(seen.themes[0] === 'dark' && seen.themes[1] === 'dark', `${name}: dark and light for both`);
  check(seen.second === 'worst', `${name}: the second sequence (${seen.second})`);
}
rmSync(folder, { recursive: true });
finish();
