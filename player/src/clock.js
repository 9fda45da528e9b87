// The clock of the player: the time that is shown, and how it runs.

export const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];
export const FRAME = 1 / 60;

export class Clock {
  constructor(start, end) {
    Object.assign(this, { start, end, time: start, playing: false, speed: 1, loop: false });
    this.listeners = [];
  }

  /** Call a function after every change. */
  listen(listener) {
    this.listeners.push(listener);
  }

  changed() {
    for (const listener of this.listeners) listener(this);
  }

  seek(time) {
    this.time = Math.min(Math.max(time, this.start), this.end);
    this.changed();
  }

  step(frames) {
    this.playing = false;
    // A step ends on a frame: the same times are met forward and backward.
    const frame = (this.time - this.start) / FRAME;
    const next = frames > 0 ? Math.floor(frame + 1e-6) + frames : Math.ceil(frame - 1e-6) + frames;
    this.seek(this.start + next * FRAME);
  }

  toggle() {
    if (!this.playing && this.time >= this.end) this.time = this.start;
    this.playing = !this.playing;
    this.last = undefined;
    this.changed();
    if (this.playing) requestAnimationFrame((now) => this.tick(now));
  }

  tick(now) {
    if (!this.playing) return;
    const passed = this.last === undefined ? 0 : Math.min((now - this.last) / 1000, 0.25);
    this.last = now;
    let time = this.time + passed * this.speed;
    if (time >= this.end) {
      this.playing = this.loop && this.end > this.start;
      time = this.playing ? this.start : this.end;
    }
    this.seek(time);
    if (this.playing) requestAnimationFrame((later) => this.tick(later));
  }

  setSpeed(speed) {
    this.speed = speed;
    this.changed();
  }

  faster(steps) {
    const index = SPEEDS.indexOf(this.speed) + steps;
    this.setSpeed(SPEEDS[Math.min(Math.max(index, 0), SPEEDS.length - 1)]);
  }
}
