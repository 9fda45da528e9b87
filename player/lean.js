// What the bundle leaves out of three: parts of shaders behind macros that the player never defines, programs of
// materials that it does not have, and sessions of virtual reality.
import { readFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';

const THREE = fileURLToPath(new URL('node_modules/three/src/', import.meta.url));

const MAPS = ['', 'ALPHA', 'AO', 'BUMP', 'CLEARCOAT', 'CLEARCOAT_NORMAL', 'CLEARCOAT_ROUGHNESS', 'DIFFUSE_ROUGHNESS', 'DISPLACEMENT', 'EMISSIVE', 'ENV', 'GRADIENT',
  'IRIDESCENCE', 'IRIDESCENCE_THICKNESS', 'LIGHT', 'METALNESS', 'NORMAL', 'ANISOTROPY', 'ROUGHNESS', 'SHEEN_COLOR', 'SHEEN_ROUGHNESS', 'SPECULAR',
  'SPECULAR_COLOR', 'SPECULAR_INTENSITY', 'THICKNESS', 'TRANSMISSION', 'PACKED_NORMAL'].map((name) => `USE_${name}MAP`);

/** Macros that no material of the player has. */
const UNDEFINED = new Set([...MAPS, 'USE_NORMALMAP_TANGENTSPACE', 'USE_NORMALMAP_OBJECTSPACE', 'USE_TANGENT', 'USE_UV', 'USE_CLEARCOAT', 'USE_IRIDESCENCE', 'USE_SHEEN', 'USE_RETROREFLECTION',
  'USE_ANISOTROPY', 'USE_DIFFUSE_ROUGHNESS', 'USE_TRANSMISSION', 'USE_DISPERSION', 'USE_SPECULAR', 'PHYSICAL', 'IOR', 'LAMBERT', 'PHONG', 'TOON', 'USE_MATCAP',
  'USE_BATCHING', 'USE_BATCHING_COLOR', 'USE_SKINNING', 'USE_MORPHTARGETS', 'USE_MORPHNORMALS', 'USE_MORPHCOLORS', 'USE_INSTANCING_MORPH', 'USE_POINTS_UV',
  'USE_FOG', 'FOG_EXP2', 'USE_ALPHAHASH', 'USE_ALPHATEST', 'ALPHA_TO_COVERAGE', 'USE_LIGHT_PROBES', 'USE_LOGARITHMIC_DEPTH_BUFFER', 'USE_REVERSED_DEPTH_BUFFER',
  'ENVMAP_TYPE_PMREM', 'ENVMAP_TYPE_CUBE', 'ENVMAP_MODE_REFLECTION', 'ENVMAP_BLENDING_MULTIPLY', 'DECODE_VIDEO_TEXTURE', 'DECODE_VIDEO_TEXTURE_EMISSIVE',
  'TONE_MAPPING', 'DITHERING', 'PREMULTIPLIED_ALPHA', 'SHADOWMAP_TYPE_VSM', 'SHADOWMAP_TYPE_BASIC', 'DISTANCE']);

/** Counts that are zero: lights of other kinds, and planes that cut. */
const ZERO = new Set(['NUM_SUN_LIGHTS', 'NUM_SUN_LIGHT_SHADOWS', 'NUM_POINT_LIGHTS', 'NUM_POINT_LIGHT_SHADOWS', 'NUM_SPOT_LIGHTS', 'NUM_SPOT_LIGHT_SHADOWS',
  'NUM_SPOT_LIGHT_COORDS', 'NUM_SPOT_LIGHT_MAPS', 'NUM_RECT_AREA_LIGHTS', 'NUM_CLIPPING_PLANES', 'NUM_LIGHT_PROBE_GRIDS']);

/** Programs of materials that the player does not have, and curves of tones. */
const NO_PROGRAM = /ShaderLib\/(background|backgroundCube|cube|distance|equirect|linedashed|meshlambert|meshmatcap|meshnormal|meshphong|meshtoon|points|sprite|vsm)\.glsl\.js$|ShaderChunk\/tonemapping_pars_fragment\.glsl\.js$/;

/** Modules with nothing to do here, and what stands in their place. */
const EMPTY = {
  'webgl/WebGLEnvironments.js': 'export function WebGLEnvironments() { return { get: (texture) => texture ?? null, dispose() {} }; }',
  'WebGLCubeRenderTarget.js': 'export class WebGLCubeRenderTarget {}',
  'webgl/WebGLOutput.js': 'export const WebGLOutput = undefined;',
  'webgl/WebGLUniformsGroups.js': 'export function WebGLUniformsGroups() { return { update() {}, bind() {}, dispose() {} }; }',
  'webgl/WebGLMorphtargets.js': 'export function WebGLMorphtargets() { return { update() {} }; }',
  'webxr/WebXRManager.js': `export class WebXRManager {
    enabled = false;
    isPresenting = false;
    addEventListener() {}
    removeEventListener() {}
    setAnimationLoop() {}
    getEnvironmentBlendMode() {}
    dispose() {}
  }`,
};

/** Methods that the player never calls: writing as JSON, and finding what lies under the pointer. */
const UNCALLED = /\n\t(?:toJSON|fromJSON|raycast|_computeIntersections)\([^)\n]*\) \{\n[\s\S]*?\n\t\}\n/g;

/** Return whether a condition of the preprocessor holds, or undefined where that is not known here. */
function truth(condition) {
  const terms = condition.trim();
  const outer = /^\(([^()]*(?:\([^()]*\)[^()]*)*)\)$/.exec(terms);
  if (outer && !terms.startsWith('defined')) return truth(outer[1]);
  if (terms.includes('||')) return combined(split(terms, '||'), true);
  if (terms.includes('&&')) return combined(split(terms, '&&'), false);
  const defined = /^(!?)\s*defined\s*\(\s*(\w+)\s*\)$/.exec(terms);
  if (defined && UNDEFINED.has(defined[2])) return defined[1] === '!';
  const above = /^(\w+)\s*>\s*0$/.exec(terms);
  if (above && ZERO.has(above[1])) return false;
  return undefined;
}

/** Return the terms of a condition between operators that no brackets hold; alone it is what it was. */
function split(condition, operator) {
  const terms = [''];
  let depth = 0;
  for (const token of condition.split(/(\|\||&&|[()])/)) {
    if (token === '(') depth += 1;
    if (token === ')') depth -= 1;
    if (token === operator && depth === 0) terms.push('');
    else terms[terms.length - 1] += token;
  }
  return terms;
}

/** Return what terms come to: one that is `decides` makes all so, and all others the contrary. */
function combined(terms, decides) {
  if (terms.length === 1) return undefined; // the operator stands within brackets
  const known = terms.map(truth);
  if (known.includes(decides)) return decides;
  return known.every((value) => value === !decides) ? !decides : undefined;
}

const DIRECTIVE = /^\s*#\s*(ifdef|ifndef|if|elif|else|endif)\b\s*([^\n]*?)\s*(?:\/\/.*)?$/;

/** Return a text of the shading language without the parts that are never compiled. */
export function preprocessed(text) {
  const lines = text.split('\n');
  let at = 0;
  const block = () => {
    const kept = [];
    while (at < lines.length) {
      const [, kind, condition] = DIRECTIVE.exec(lines[at]) ?? [];
      if (kind === undefined) kept.push(lines[at++]);
      else if (kind.startsWith('if')) kept.push(...chain(kind, condition));
      else return kept;
    }
    return kept;
  };
  const chain = (first, of) => {
    const asked = { ifdef: `defined( ${of} )`, ifndef: `! defined( ${of} )` }[first] ?? of;
    const branches = [];
    let condition = asked;
    for (;;) {
      at += 1;
      const body = block();
      branches.push({ condition, holds: condition === undefined ? true : truth(condition), body });
      const [, kind, next] = DIRECTIVE.exec(lines[at]) ?? [];
      if (kind === 'endif') break;
      if (kind === undefined) throw new Error(`#${first} ${of} has no end`);
      condition = kind === 'elif' ? next : undefined;
    }
    at += 1;
    const possible = branches.filter(({ holds }) => holds !== false);
    const sure = possible.findIndex(({ holds }) => holds === true);
    const left = sure < 0 ? possible : possible.slice(0, sure + 1);
    if (!left.length) return [];
    if (left[0].holds) return left[0].body;
    const word = (branch, index) => (index === 0 ? `#if ${branch.condition}` : branch.holds ? '#else' : `#elif ${branch.condition}`);
    return [...left.flatMap((branch, index) => [word(branch, index), ...branch.body]), '#endif'];
  };
  const kept = block();
  if (at < lines.length) throw new Error(`${lines[at]} ends nothing`);
  return kept.join('\n');
}

/** Return a text of the shading language without comments, indentation and empty lines. */
const dense = (text) => text.replace(/\/\*[\s\S]*?\*\//g, '').split('\n').map((line) => line.replace(/\/\/.*$/, '').trim()).filter(Boolean).join('\n');

/** Names of colours: the player's are numbers. */
const COLOUR_NAMES = /const _colorKeywords = \{[^}]*\};/;

/** Uniforms of those programs. */
const NO_UNIFORMS = /\n\t(?:lambert|phong|toon|matcap|points|dashed|normal|sprite|background|backgroundCube|cube|equirect|distance): \{\n[\s\S]*?\n\t\},?\n/g;

/** Warnings and errors that three writes to the console, of a line each: a page says nothing, and what is thrown stays. */
const WARNING = /^[ \t]*(?:warn|warnOnce|error|console\.warn|console\.error)\([^;\n]*\);$/gm;

const METHOD = /\n\t(?:static |get |set )?(\w+)\([^)\n]*\) \{\n(?:[\s\S]*?\n)?\t\}\n/g;

/** Return a module without the methods of its classes that none of the names calls. */
const withoutMethods = (text, names) => text.replace(METHOD, (method, name) => (name === 'constructor' || names.has(name) ? method : '\n'));

/** Return all names that texts take from some object, or have in quotes, comments left out. */
export function namesIn(texts) {
  const names = new Set();
  for (const text of texts) {
    const code = text.replace(/\/\*[\s\S]*?\*\//g, '').replace(/^\s*\/\/.*$/gm, '');
    for (const [, taken, quoted] of code.matchAll(/\.\s*([A-Za-z_$][\w$]*)|['"`]([A-Za-z_$][\w$]*)['"`]/g)) names.add(taken ?? quoted);
  }
  return names;
}

/**
 * Return a plugin of esbuild: three from its sources, without what the player does not use.
 * @param {Set} names That anybody calls a method by; undefined before that is known.
 * @param {Map} seen Is filled with the text of each module by its path.
 */
export const lean = (names, seen) => ({
  name: 'lean',
  setup(build) {
    const js = (path, contents) => {
      const shorter = names && path.startsWith(THREE) ? withoutMethods(contents, names) : contents;
      seen.set(path, shorter);
      return { contents: shorter, loader: 'js' };
    };
    build.onResolve({ filter: /^three$/ }, () => ({ path: `${THREE}Three.js`, sideEffects: false }));
    build.onLoad({ filter: /\.glsl\.js$/ }, ({ path }) => {
      const shorter = (_, text) => `\`${NO_PROGRAM.test(path) ? '' : dense(preprocessed(text))}\``;
      return { contents: readFileSync(path, 'utf-8').replace(/\/\* glsl \*\/\s*`([\s\S]*?)`/g, shorter), loader: 'js' };
    });
    build.onLoad({ filter: /\.js$/ }, ({ path }) => {
      const known = EMPTY[path.slice(`${THREE}renderers/`.length)] ?? readFileSync(path, 'utf-8');
      const source = path.endsWith('/ShaderLib.js') ? known.replace(NO_UNIFORMS, '\n').replace(NO_UNIFORMS, '\n') : known;
      return js(path, path.startsWith(THREE) ? source.replace(UNCALLED, '\n').replace(COLOUR_NAMES, 'const _colorKeywords = {};').replace(WARNING, ';') : source);
    });
  },
});
