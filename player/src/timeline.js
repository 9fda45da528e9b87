// The transport: play, step, speed, and a time line with the moves and what was found.
import { SPEEDS } from './clock.js';
import { ICONS, element, icon } from './dom.js';
import { seconds } from './numbers.js';

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
    this.element = element('div.transport', { role: 'group', 'aria-label': 'Playback' }, this.line(), element('div.controls', {}, buttons, element('div.time', {}, this.now, end), more));
    clock.listen(() => this.update());
    this.update();
  }

  line() {
    const { clock, scene } = this;
    const part = (time) => (clock.end > clock.start ? `${(100 * (time - clock.start)) / (clock.end - clock.start)}%` : '0%');
    this.fill = element('div.fill');
    this.knob = element('div.knob');
    const moves = scene.moves.map(({ index, label, start, end }) => {
      const move = element('div.move', { title: label }, element('span', { text: index }));
      move.style.left = part(start);
      move.style.width = `calc(${part(end)} - ${part(start)})`;
      return move;
    });
    const marks = scene.findings.slice(0, MOST_MARKS).map(({ time, message }) => {
      const mark = element('div.mark', { title: message });
      mark.style.left = part(time);
      return mark;
    });
    this.part = part;
    this.track = element('div.track', {
      role: 'slider', tabindex: 0, 'aria-label': 'Time', 'aria-valuemin': clock.start, 'aria-valuemax': clock.end,
      onpointerdown: (event) => this.grab(event), onpointermove: (event) => this.drag(event),
    }, ...moves, this.fill, ...marks, this.knob);
    return this.track;
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
