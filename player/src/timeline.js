// The transport: play, step, speed, and a time line with the moves and what was found.
import { SPEEDS } from './clock.js';
import { ICONS, element, icon } from './dom.js';
import { seconds } from './numbers.js';
import { moveAt } from './status.js';

const MOST_MARKS = 400;

export class Transport {
  constructor(scene, clock) {
    this.clock = clock;
    this.scene = scene;
    const button = (name, label, onclick) => element('button.round', { type: 'button', 'aria-label': label, title: label, onclick }, icon(...ICONS[name]));
    this.play = button('play', 'Play (space)', () => clock.toggle());
    this.play.classList.add('primary');
    this.loop = button('loop', 'Repeat (l)', () => {
      clock.loop = !clock.loop;
      clock.changed();
    });
    this.speed = element('select.speed', { 'aria-label': 'Speed', title: 'Speed (+ and \u2212)', onchange: () => clock.setSpeed(Number(this.speed.value)) },
      ...SPEEDS.map((speed) => element('option', { value: speed, text: `${speed}\u00d7` })));
    this.now = element('span.now');
    const end = element('span.end', { text: ` / ${seconds(clock.end)} s` });
    const buttons = element('div.buttons', {},
      button('first', 'To the start (Home)', () => clock.seek(clock.start)),
      button('back', 'A frame back (\u2190)', () => clock.step(-1)),
      this.play,
      button('forward', 'A frame on (\u2192)', () => clock.step(1)),
      button('last', 'To the end (End)', () => clock.seek(clock.end)));
    const more = element('div.buttons', {}, this.loop, this.speed);
    this.element = element('div.transport', { role: 'group', 'aria-label': 'Playback' }, this.line(), ...this.lanes(), element('div.controls', {}, buttons, element('div.time', {}, this.now, end), more));
    clock.listen(() => this.update());
    this.update();
  }

  line() {
    const { clock, scene } = this;
    const part = (time) => (clock.end > clock.start ? `${(100 * (time - clock.start)) / (clock.end - clock.start)}%` : '0%');
    this.fill = element('div.fill');
    this.knob = element('div.knob');
    const moves = scene.moves.map(({ index, title, label, start, end }) => {
      const move = element('div.move', { title: label }, element('span.move-index', { text: index }), element('span.move-title', { text: title ?? '' }));
      move.style.left = part(start);
      move.style.width = `calc(${part(end)} - ${part(start)})`;
      return move;
    });
    const handled = scene.marks.map(({ time, label }) => {
      const mark = element('div.handled', { title: label });
      mark.style.left = part(time);
      return mark;
    });
    const marks = scene.findings.slice(0, MOST_MARKS).map(({ time, message }) => {
      const mark = element('div.mark', { title: message });
      mark.style.left = part(time);
      return mark;
    });
    this.part = part;
    this.moves = moves;
    this.track = element('div.track', {
      role: 'slider', tabindex: 0, 'aria-label': 'Time', 'aria-valuemin': clock.start, 'aria-valuemax': clock.end,
      onpointerdown: (event) => this.grab(event), onpointermove: (event) => this.drag(event),
    }, ...moves, this.fill, ...handled, ...marks, this.knob);
    return this.track;
  }

  /** Return the lanes below the time line: what is carried, and the signals, each with its values over time. */
  lanes() {
    const { clock, scene } = this;
    const { start, end } = clock;
    const loads = scene.loads.map((load) => ({ ...load, text: `${Number(load.mass.toPrecision(3))} kg`, share: 1, title: 'carried' }));
    const lanes = loads.length ? [{ name: 'load', parts: loads }] : [];
    for (const { name, changes } of scene.signals) {
      const largest = Math.max(...changes.map(({ value }) => Math.abs(value)));
      const parts = changes.map(({ time, value, label }, k) => ({ start: time, end: changes[k + 1]?.time ?? end, text: Number(value.toPrecision(4)), share: largest > 0 ? Math.abs(value) / largest : 0, title: `${name} = ${value} from ${seconds(time)} s on, by ${label}` }));
      lanes.push({ name, parts });
    }
    this.values = lanes.map(({ name, parts }) => ({ parts, name, node: element('span.lane-name', { text: name }) }));
    return lanes.map(({ parts }, index) => element('div.lane', {}, ...parts.map((part) => {
      const bar = element('div.lane-part', { title: part.title }, element('span', { text: part.share > 0 ? part.text : '' }));
      bar.style.left = this.part(Math.max(part.start, start));
      bar.style.width = `calc(${this.part(part.end)} - ${this.part(part.start)})`;
      bar.style.setProperty('--share', part.share);
      return bar;
    }), this.values[index].node));
  }

  grab(event) {
    this.track.setPointerCapture(event.pointerId);
    this.drag(event);
  }

  drag(event) {
    if (!this.track.hasPointerCapture(event.pointerId)) return;
    const { left, width } = this.track.getBoundingClientRect();
    const { start, end } = this.clock;
    this.clock.seek(start + ((event.clientX - left) / width) * (end - start));
  }

  update() {
    const { clock } = this;
    const at = this.part(clock.time);
    this.fill.style.width = at;
    this.knob.style.left = at;
    const current = moveAt(this.scene.moves, clock.time);
    this.moves.forEach((move, k) => move.classList.toggle('current', k === current));
    this.now.textContent = seconds(clock.time);
    this.track.setAttribute('aria-valuenow', clock.time);
    this.track.setAttribute('aria-valuetext', `${seconds(clock.time)} s`);
    if (this.shows !== clock.playing) {
      this.shows = clock.playing;
      this.play.replaceChildren(icon(...ICONS[clock.playing ? 'pause' : 'play']));
      this.play.setAttribute('aria-label', clock.playing ? 'Pause (space)' : 'Play (space)');
    }
    this.loop.setAttribute('aria-pressed', clock.loop);
    this.speed.value = clock.speed;
  }
}
