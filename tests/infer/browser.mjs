// A page from disk in headless Chromium, without network: what the tests of pages share.
import { spawnSync } from 'node:child_process';
import { existsSync, mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';

const chromium = [process.env.CHROMIUM, '/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome']
  .find((path) => path && existsSync(path));
if (!chromium) {
  console.log('skipped: no Chromium found (set CHROMIUM)');
  process.exit(77);
}

// Standard output and error of Chromium with `more` options on PAGE#hash.
export function browse(page, hash, size, ...more) {
  const profile = mkdtempSync(join(tmpdir(), 'restage-chromium-'));
  const result = spawnSync(chromium, [
    '--headless', '--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run',
    '--disable-background-networking', '--disable-component-update', '--disable-sync',
    '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--hide-scrollbars',
    '--host-resolver-rules=MAP * ~NOTFOUND', '--enable-logging=stderr', '--v=0',
    `--window-size=${size}`, '--virtual-time-budget=3000', `--user-data-dir=${profile}`,
    ...more, `file://${resolve(page)}#${hash}`,
  ], { encoding: 'utf8', timeout: 120000, maxBuffer: 1 << 28 });
  rmSync(profile, { recursive: true, force: true, maxRetries: 5 });
  return result;
}

export const scriptErrors = ({ stderr }) => stderr.split('\n')
  .filter((l) => /CONSOLE.*(Error|Uncaught|violat)/i.test(l) && !/GL Driver Message/.test(l));

let bad = 0;
export function check(good, text) {
  console.log(`${good ? 'ok  ' : 'FAIL'} ${text}`);
  bad += !good;
}
export const finish = () => process.exit(bad ? 1 : 0);
