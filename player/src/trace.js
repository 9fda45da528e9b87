// The path of the tool, coloured by its speed, and the legend of the colours.
import { Color, CylinderGeometry, InstancedMesh, MeshBasicMaterial, Object3D, SRGBColorSpace, Vector3 } from 'three';
import { element } from './dom.js';
import { unpack } from './motion.js';
import { significant } from './numbers.js';

const UP = new Vector3(0, 1, 0);
const STILL = 1e-7; // m: a tool that moves less between two rows does not move

export class Trace {
  /**
   * @param {object} tool Positions and speeds on the rows of the motion.
   * @param {Motion} motion The rows.
   * @param {number} thickness Radius of the line, m.
   * @param {Theme} theme The colours.
   * @param {Function} colour Of the whole line by the theme's name; without it that of the speed.
   */
  constructor(tool, motion, thickness, theme, colour = undefined) {
    this.colour = colour;
    const { count } = motion;
    this.motion = motion;
    this.theme = theme;
    const [x, y, z] = unpack(tool.positions, count);
    [this.speeds] = unpack(tool.speeds, count);
    this.points = Array.from(x, (value, row) => new Vector3(value, y[row], z[row]));
    this.largest = this.speeds.reduce((most, speed) => Math.max(most, speed), 0);
    this.parts = this.points.flatMap((point, row) => (row && point.distanceTo(this.points[row - 1]) > STILL ? [row] : []));
    this.line = new InstancedMesh(new CylinderGeometry(1, 1, 1, 8), new MeshBasicMaterial(), Math.max(this.parts.length, 1));
    this.line.count = this.parts.length;
    this.line.frustumCulled = false;
    this.lay(thickness);
    this.legend = this.makeLegend(tool);
    this.paint();
  }

  /** Return the speed of the tool at a time, m/s. */
  speedAt(time) {
    return this.motion.between(this.speeds, time);
  }

  /** Lay a cylinder from each row to the next. */
  lay(thickness) {
    const part = new Object3D();
    this.parts.forEach((row, index) => {
      const [from, to] = [this.points[row - 1], this.points[row]];
      const axis = new Vector3().subVectors(to, from);
      part.position.addVectors(from, to).multiplyScalar(0.5);
      part.scale.set(thickness, axis.length() * 1.02, thickness);
      part.quaternion.setFromUnitVectors(UP, axis.normalize());
      part.updateMatrix();
      this.line.setMatrixAt(index, part.matrix);
    });
  }

  makeLegend({ unit, scale }) {
    const low = element('span', { text: '0' });
    const high = element('span', { text: `${significant(this.largest * scale, 3)} ${unit}` });
    this.bar = element('div.speed-bar');
    return element('div.speed-legend', { title: 'Speed of the tool, by the colour of its path' }, element('span.speed-name', { text: 'tool speed' }), low, this.bar, high);
  }

  /** Give the line and the legend the colours of the theme. */
  paint() {
    if (this.colour) {
      this.line.material.color.set(this.colour(this.theme.name));
      return;
    }
    this.parts.forEach((row, index) => {
      const speed = (this.speeds[row - 1] + this.speeds[row]) / 2;
      const [r, g, b] = this.theme.speed(this.largest > 0 ? speed / this.largest : 0);
      this.line.setColorAt(index, new Color().setRGB(r, g, b, SRGBColorSpace));
    });
    if (this.line.instanceColor) this.line.instanceColor.needsUpdate = true;
    this.bar.style.background = this.theme.speedGradient();
  }
}
