// Opens a viewer page from disk in headless Chromium, with WebGL and with the 2D canvas, and checks
// that it drew: node page_screenshot.mjs PAGE.html [FOLDER for the pictures]
// Exit code 0: good; 1: blank, wrong renderer or script errors; 77: no Chromium (set CHROMIUM).
import { existsSync, mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { inflateSync } from 'node:zlib';
import { browse, check, finish, scriptErrors } from './browser.mjs';

const [page, folder] = process.argv.slice(2);
if (!page) {
  console.error('usage: node page_screenshot.mjs PAGE.html [FOLDER]');
  process.exit(2);
}
// 8-bit RGB or RGBA pixels of a PNG without interlacing.
function decode(png) {
  const width = png.readUInt32BE(16), height = png.readUInt32BE(20), size = png[25] === 6 ? 4 : 3;
  const parts = [];
  for (let at = 8; at < png.length; at += 12 + png.readUInt32BE(at))
    if (png.toString('latin1', at + 4, at + 8) === 'IDAT') parts.push(png.subarray(at + 8, at + 8 + png.readUInt32BE(at)));
  const raw = inflateSync(Buffer.concat(parts)), line = width * size, out = Buffer.alloc(line * height);
  for (let y = 0; y < height; ++y)
    for (let k = 0; k < line; ++k) {
      const left = k < size ? 0 : out[y * line + k - size], up = y ? out[(y - 1) * line + k] : 0;
      const corner = y && k >= size ? out[(y - 1) * line + k - size] : 0, p = left + up - corner;
      const [a, b, c] = [Math.abs(p - left), Math.abs(p - up), Math.abs(p - corner)];
      const paeth = a <= b && a <= c ? left : b <= c ? up : corner;
      out[y * line + k] = raw[y * (line + 1) + 1 + k] + [0, left, up, (left + up) >> 1, paeth][raw[y * (line + 1)]];
    }
  return { width, height, size, out };
}

// Pixels inside the views whose colours differ clearly between channels: the figures.
function coloured({ width, height, size, out }, from, to) {
  let count = 0;
  for (let y = Math.round(0.18 * height); y < 0.84 * height; ++y)
    for (let x = Math.round(from * width); x < to * width; ++x) {
      const k = (y * width + x) * size, rgb = [out[k], out[k + 1], out[k + 2]];
      count += Math.max(...rgb) - Math.min(...rgb) > 35;
    }
  return count;
}

const show = (hash, ...more) => browse(page, `frame=5&light${hash}`, '1200,700', ...more);
for (const [name, hash] of [['webgl', ''], ['canvas2d', '&2d']]) {
  const dom = show(hash, '--dump-dom');
  const renderer = /data-renderer="(\w+)"/.exec(dom.stdout)?.[1], views = (dom.stdout.match(/id="panel\d"/g) ?? []).length;
  check(renderer === name, `drawn with ${renderer}, expected ${name}`);
  check(/data-ready="\d+x\d+"/.test(dom.stdout), 'first frame was drawn');
  const errors = scriptErrors(dom);
  check(errors.length === 0, `no script errors ${errors.slice(0, 3).join(' | ')}`);
  const shots = folder ?? mkdtempSync(join(tmpdir(), 'restage-shots-')), file = join(shots, `page_${name}.png`);
  show(hash, `--screenshot=${file}`);
  const picture = existsSync(file) ? decode(readFileSync(file)) : null;
  check(picture !== null, 'a screenshot was taken');
  for (let v = 0; picture && v < views; ++v) {
    const count = coloured(picture, v / views, (v + 1) / views);
    check(count > 2000, `view ${v + 1} of ${views}: ${count} coloured pixels`);
  }
  if (!folder) rmSync(shots, { recursive: true });
}
finish();
