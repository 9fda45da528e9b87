// A line under the view in space: the move of now, and the pose and the speed of the tool.
import { Euler } from 'three';
import { element } from './dom.js';
import { fixed, significant } from './numbers.js';

/** Return the index of the move of a time: at a border the later one; -1 where there is none. */
export const moveAt = (moves, time) => moves.findLastIndex(({ start }) => start <= time + 1e-9);

export class Status {
  /**
   * @param {object} scene What the page shows.
   * @param {Clock} clock When.
   * @param {Stage} stage The arm that is drawn; undefined where there is none.
   */
  constructor(scene, clock, stage) {
    Object.assign(this, { scene, clock, stage });
    this.move = element('span.status-move');
    this.tool = element('span.status-tool', { title: 'Tool: position, roll pitch yaw about fixed axes, speed' });
    this.element = element('div.status', {}, this.move, this.tool);
  }

  update() {
    const { moves } = this.scene;
    const index = moveAt(moves, this.clock.time);
    this.move.textContent = index < 0 ? '' : moves[index].label;
    this.move.title = this.move.textContent;
    if (this.stage) this.tool.replaceChildren(...this.words());
  }

  words() {
    const { length, angle, tool } = this.scene;
    const { arm, trace } = this.stage;
    const { x, y, z } = arm.toolPosition();
    const { x: roll, y: pitch, z: yaw } = new Euler().setFromRotationMatrix(arm.tool.matrixWorld, 'ZYX');
    const lengths = [x, y, z].map((value) => fixed(value * length.scale, length.scale > 2 ? 1 : 4));
    const angles = [roll, pitch, yaw].map((value) => fixed(value * angle.scale, angle.scale > 2 ? 1 : 4));
    const speed = trace.speedAt(this.clock.time) * tool.scale;
    const part = (name, values, unit) => element('span', {}, element('span.status-name', { text: name }), ` ${values.join(' ')} `, element('span.unit', { text: unit }));
    return [part('xyz', lengths, length.unit), part('rpy', angles, angle.unit), part('', [significant(speed, 3)], tool.unit)];
  }
}
