// Builds the bundle of `trajcli view`: one script, one style sheet, their licences, and a manifest that says
// from which sources they were made. Run by `make player`.
import { createHash } from 'node:crypto';
import { mkdirSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import * as esbuild from 'esbuild';
import { lean } from './lean.js';

const here = dirname(fileURLToPath(import.meta.url));
const target = join(here, '..', 'trajcli', 'player', 'bundle');
const sources = ['build.js', 'lean.js', 'package.json', 'package-lock.json', ...readdirSync(join(here, 'src')).map((name) => `src/${name}`)].sort();
const sha256 = (bytes) => createHash('sha256').update(bytes).digest('hex');

const { outputFiles } = await esbuild.build({
  entryPoints: { player: join(here, 'src', 'main.js'), loader: join(here, 'src', 'loader.js'), style: join(here, 'src', 'style.css') },
  bundle: true,
  minify: true,
  plugins: [lean],
  format: 'iife',
  target: ['chrome113', 'firefox113', 'safari16.4'],
  legalComments: 'eof',
  charset: 'ascii', // the page may be served with any encoding
  outdir: target,
  write: false,
});

rmSync(target, { recursive: true, force: true });
mkdirSync(target, { recursive: true });
const files = {};
const write = (name, text) => {
  if (/<\/script|<\/style|<!--/i.test(text)) throw new Error(`${name} would end the element that holds it`);
  writeFileSync(join(target, name), text);
  files[name] = sha256(text);
};
for (const { path, text } of outputFiles) write(path.slice(target.length + 1), text);

const packages = ['three', 'uplot'].map((name) => {
  const folder = join(here, 'node_modules', name);
  const { version, license, homepage } = JSON.parse(readFileSync(join(folder, 'package.json'), 'utf-8'));
  return `${name} ${version} (${license}), ${homepage ?? ''}\n\n${readFileSync(join(folder, 'LICENSE'), 'utf-8').trim()}\n`;
});
write('LICENSES', `The bundle of the player holds these libraries.\n\n${packages.join(`\n${'='.repeat(78)}\n\n`)}`);

const manifest = {
  made_by: 'make player',
  sources: Object.fromEntries(sources.map((name) => [name, sha256(readFileSync(join(here, name)))])),
  files,
};
writeFileSync(join(target, 'manifest.json'), `${JSON.stringify(manifest, null, 2)}\n`);
for (const name of Object.keys(files)) console.log(`${name}: ${readFileSync(join(target, name)).length} bytes`);
