// Runs the Khronos glTF validator on GLB files: node validate_glb.mjs FILE.glb ...
// Exit code 0: no errors and no warnings; 1: some; 77: the npm module gltf-validator is not there
// (`npm install gltf-validator` in any folder, then GLTF_VALIDATOR=FOLDER/node_modules).
import { createRequire } from 'node:module';
import { readFileSync } from 'node:fs';
import { basename, join } from 'node:path';

const require = createRequire(import.meta.url);
let validator;
try {
  const folder = process.env.GLTF_VALIDATOR;
  validator = require(folder ? join(folder, 'gltf-validator') : 'gltf-validator');
} catch {
  console.log('skipped: npm module gltf-validator not found (set GLTF_VALIDATOR)');
  process.exit(77);
}
const files = process.argv.slice(2);
if (files.length === 0) {
  console.error('usage: node validate_glb.mjs FILE.glb ...');
  process.exit(2);
}
let bad = 0;
for (const file of files) {
  const report = await validator.validateBytes(new Uint8Array(readFileSync(file)));
  const { numErrors, numWarnings, messages } = report.issues;
  bad += numErrors + numWarnings;
  console.log(`${basename(file)}: ${numErrors} errors, ${numWarnings} warnings`);
  for (const m of messages.filter((m) => m.severity < 2).slice(0, 10))
    console.log(`  ${m.code} ${m.pointer ?? ''}: ${m.message}`);
}
process.exit(bad ? 1 : 0);
