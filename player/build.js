// Builds the bundle of `trajcli view`: one script, one style sheet, their licences, and a manifest that says
// from which sources they were made. Run by `make player`.
import { createHash } from 'node:crypto';
import { mkdirSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { spawnSync } from 'node:child_process';
import * as esbuild from 'esbuild';
import { minify } from 'terser';
import { lean, namesIn } from './lean.js';

const here = dirname(fileURLToPath(import.meta.url));
const target = join(here, '..', 'trajcli', 'player', 'bundle');
const sources = ['build.js', 'lean.js', 'package.json', 'package-lock.json', ...readdirSync(join(here, 'src')).map((name) => `src/${name}`)].sort();
const sha256 = (bytes) => createHash('sha256').update(bytes).digest('hex');

/** Return what esbuild makes, and the texts of the modules that stand in it, where only methods with these names are kept. */
async function built(names) {
  const seen = new Map();
  const { outputFiles, metafile } = await esbuild.build({
    entryPoints: { player: join(here, 'src', 'main.js'), loader: join(here, 'src', 'loader.js'), style: join(here, 'src', 'style.css') },
    bundle: true,
    minify: true,
    plugins: [lean(names, seen)],
    metafile: true,
    format: 'iife',
    target: ['chrome113', 'firefox113', 'safari16.4'],
    legalComments: 'eof',
    charset: 'ascii', // the page may be served with any encoding
    outdir: target,
    write: false,
  });
  const used = Object.values(metafile.outputs).flatMap(({ inputs }) => Object.entries(inputs).filter(([, { bytesInOutput }]) => bytesInOutput > 0).map(([path]) => join(process.cwd(), path)));
  return { outputFiles, texts: used.map((path) => seen.get(path) ?? '') };
}

// A method that only left out methods call is left out, too: until nothing more is.
let { outputFiles, texts } = await built();
for (let size = Infinity; outputFiles[0].contents.length < size;) {
  size = outputFiles[0].contents.length;
  ({ outputFiles, texts } = await built(namesIn(texts)));
}

rmSync(target, { recursive: true, force: true });
mkdirSync(target, { recursive: true });
const files = {};
const write = (name, text) => {
  if (/<\/script|<\/style|<!--/i.test(text)) throw new Error(`${name} would end the element that holds it`);
  const [file, content] = name === 'player.js' ? [`${name}.xz`, packed(text)] : [name, text];
  writeFileSync(join(target, file), content);
  files[file] = sha256(content);
};
/** Return what a text is as .xz, which Python makes and reads; the script is most of a wheel that packs worse. */
function packed(text) {
  const program = 'import lzma, sys; sys.stdout.buffer.write(lzma.compress(sys.stdin.buffer.read(), format=lzma.FORMAT_XZ, filters=[{"id": lzma.FILTER_LZMA2, "preset": 9 | lzma.PRESET_EXTREME, "pb": 0}]))';
  const { stdout, status } = spawnSync('python3', ['-c', program], { input: text, maxBuffer: 1 << 26 });
  if (status !== 0) throw new Error('this needs python3 with lzma');
  return stdout;
}

// Terser leaves out what esbuild keeps: a twentieth of what is packed.
const smaller = async (text) => (await minify(text, { compress: { passes: 2 }, ecma: 2020, format: { ascii_only: true, comments: 'some', ecma: 2020 } })).code;
for (const { path, text } of outputFiles) write(path.slice(target.length + 1), path.endsWith('player.js') ? await smaller(text) : text);

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
