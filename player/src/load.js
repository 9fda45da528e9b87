// What the tool carries: a ball at its centre of mass, between the times when it is taken up and left.
import { Mesh, MeshStandardMaterial, SphereGeometry } from 'three';
import { worldPlace } from './labels.js';

export class Loads {
  /**
   * @param {object[]} loads Each with start and end, s, mass, kg, com in the tcp's frame and radius, m.
   * @param {Arm} arm What carries them.
   * @param {Labels} labels Where their masses are written.
   * @param {number} end When the motion ends: a load that is kept to the end is seen there.
   */
  constructor(loads, arm, labels, end) {
    this.end = end;
    this.material = new MeshStandardMaterial({ transparent: true, opacity: 0.5, roughness: 0.5, depthWrite: false });
    const ball = new SphereGeometry(1, 32, 20);
    this.all = loads.map((load) => {
      const mesh = new Mesh(ball, this.material);
      mesh.position.set(...load.com);
      mesh.scale.setScalar(load.radius);
      mesh.renderOrder = 3;
      arm.tool.add(mesh);
      return { ...load, mesh, label: labels.add(`${Number(load.mass.toPrecision(3))} kg`, worldPlace(mesh), 'load') };
    });
  }

  /** Show what is carried at a time. */
  seek(time) {
    for (const { start, end, mesh, label } of this.all) {
      mesh.visible = start <= time && (time < end || (end >= this.end && time >= this.end));
      label.hidden = !mesh.visible;
    }
  }
}
