// Colours, for a light and a dark page: those of joints and of speeds can be told apart by colour-blind people.

// From those of Okabe and Ito, moved apart: any two differ by 14 in CIEDE2000, also as people see them who lack a
// kind of cones. The seventh joint has the first colour again, with a dashed line.
const JOINTS = {
  light: ['#0055a9', '#e3690d', '#188a64', '#b06a9a', '#765400', '#0c9bf2'],
  dark: ['#128aff', '#fe700e', '#31cf9f', '#e991c4', '#fddc56', '#dcf8ff'],
};

// Samples of viridis (van der Walt and Smith), whose lightness rises evenly.
const VIRIDIS = ['440154', '482475', '414487', '355f8d', '2a788e', '21918c', '22a884', '44bf70', '7ad151', 'bddf26', 'fde725'];
const SPAN = { light: [0, 0.88], dark: [0.3, 1] }; // the part of it that stands out against the page

export const SCENE = {
  light: {
    background: '#eef2f7', grid: '#c3ccd9', gridMain: '#9aa7b8', link: '#e9edf2', joint: '#2f74c9', prismatic: '#d9822b',
    dark: '#4a5568', ghost: '#4b7fc4', waypoint: '#c2410c', load: '#7c3aed', zone: '#8a5200', programmed: '#17202e', other: '#c2410c', shadow: 0.2, sky: '#ffffff', ground: '#b9c3d0', fill: 1.9, sun: 2.2,
  },
  dark: {
    background: '#10161f', grid: '#263141', gridMain: '#40506a', link: '#c5cedb', joint: '#3d8ee6', prismatic: '#e8973a',
    dark: '#5b6b82', ghost: '#7db4f5', waypoint: '#ffb27a', load: '#b794f6', zone: '#f0b45c', programmed: '#e6ebf3', other: '#ff8b3d', shadow: 0.45, sky: '#c8d8ef', ground: '#1b2430', fill: 1.4, sun: 2.4,
  },
};

const media = matchMedia('(prefers-color-scheme: dark)');

export class Theme {
  constructor() {
    this.listeners = [];
    this.chosen = undefined;
    media.addEventListener('change', () => this.apply());
    this.apply();
  }

  get name() {
    return this.chosen ?? (media.matches ? 'dark' : 'light');
  }

  listen(listener) {
    this.listeners.push(listener);
  }

  toggle() {
    this.chosen = this.name === 'dark' ? 'light' : 'dark';
    this.apply();
  }

  apply() {
    document.documentElement.dataset.theme = this.name;
    for (const listener of this.listeners) listener(this.name);
  }

  /** Return the colour of a joint, and the dashes of its line. */
  joint(index) {
    const colors = JOINTS[this.name];
    return { color: colors[index % colors.length], dash: index < colors.length ? [] : [6, 3] };
  }

  /** Return the colour [r, g, b], each 0 to 1, of a part of the largest speed. */
  speed(part) {
    const [low, high] = SPAN[this.name];
    const s = (low + (high - low) * Math.min(Math.max(part, 0), 1)) * (VIRIDIS.length - 1);
    const index = Math.min(Math.floor(s), VIRIDIS.length - 2);
    const [a, b] = [VIRIDIS[index], VIRIDIS[index + 1]].map((text) => [0, 2, 4].map((at) => parseInt(text.slice(at, at + 2), 16) / 255));
    return a.map((value, channel) => value + (s - index) * (b[channel] - value));
  }

  /** Return the colours of speeds as a gradient of CSS. */
  speedGradient() {
    const stops = Array.from({ length: 11 }, (_, k) => `rgb(${this.speed(k / 10).map((value) => Math.round(255 * value)).join(' ')})`);
    return `linear-gradient(to right, ${stops.join(', ')})`;
  }

  css(name) {
    return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  }
}
