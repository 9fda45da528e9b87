// The arm as a tree of frames: each Denavit-Hartenberg row is drawn by two cylinders, for d and for a.
import { BoxGeometry, CylinderGeometry, Group, Matrix4, Mesh, MeshBasicMaterial, SphereGeometry, Vector3 } from 'three';
import { partOf } from './meshes.js';

const UP = new Vector3(0, 1, 0); // the axis of three's cylinders
const CYLINDER = new CylinderGeometry(1, 1, 1, 28);
const SPHERE = new SphereGeometry(1, 32, 20);
const BOX = new BoxGeometry(1, 1, 1);

const matrix = (rows) => new Matrix4().set(...rows.flat());

function mesh(geometry, material) {
  const made = new Mesh(geometry, material);
  made.castShadow = !material.transparent;
  return made;
}

/** Put a cylinder of a radius between two points. */
function span(cylinder, from, to, radius) {
  const axis = new Vector3().subVectors(to, from);
  const length = axis.length();
  cylinder.visible = length > 1e-6;
  cylinder.position.addVectors(from, to).multiplyScalar(0.5);
  cylinder.scale.set(radius, Math.max(length, 1e-6), radius);
  if (length > 1e-6) cylinder.quaternion.setFromUnitVectors(UP, axis.normalize());
}

function rod(material, from, to, radius) {
  const made = mesh(CYLINDER, material);
  span(made, new Vector3(...from), new Vector3(...to), radius);
  return made;
}

const AXES = ['#d6453d', '#3f9b45', '#2f6fe0'].map((color) => new MeshBasicMaterial({ color }));

/** Return the axes x, y, z of a frame in red, green, blue, of a length in m. */
export function axesOf(length) {
  const axes = new Group();
  AXES.forEach((material, index) => {
    const end = [0, 0, 0];
    end[index] = length;
    const axis = rod(material, [0, 0, 0], end, 0.016 * length);
    axis.castShadow = false;
    axes.add(axis);
  });
  return axes;
}

/** Return how long the arm is when it is stretched, m: what its parts are scaled by. */
export function extent(robot) {
  const sizes = robot.rows.map((row) => {
    const slide = row.prismatic ? Math.max(...row.range.map((value) => Math.abs(row.d + row.sign * value))) : Math.abs(row.d);
    return Math.abs(row.a) + slide;
  });
  const tool = new Vector3().setFromMatrixPosition(matrix(robot.tool)).length();
  return Math.max(sizes.reduce((sum, size) => sum + size, tool), 1e-3);
}

export class Arm {
  /**
   * @param {object} robot Rows, base and tool.
   * @param {object} materials link, joint, prismatic, dark; of a ghost all are one.
   * @param {boolean} frames Whether the frames of all links can be shown.
   */
  constructor(robot, materials, frames = false) {
    this.robot = robot;
    this.materials = materials;
    this.size = extent(robot);
    this.root = new Group();
    this.axes = [];
    this.joints = [];
    this.frames = frames;
    this.meshes = robot.meshes ?? [];
    let parent = this.fixed(this.root, matrix(robot.base));
    if (!robot.rows[0].prismatic && !this.dress(parent, 0)) this.foot(parent);
    robot.rows.forEach((row, index) => {
      parent = this.link(parent, row, index);
    });
    this.tool = this.fixed(parent, matrix(robot.tool));
    this.tip = mesh(CYLINDER, materials.dark);
    parent.add(this.tip);
    this.mount(matrix(robot.tool));
    const dot = mesh(SPHERE, materials.dark);
    dot.scale.setScalar(0.42 * this.radius(robot.rows.length));
    this.tool.add(dot);
    if (frames) this.tool.add(axesOf(0.1 * this.size));
  }

  /** Return the radius of the parts of a row: thinner towards the tool. */
  radius(index) {
    return this.size * (0.036 - (0.018 * index) / Math.max(this.robot.rows.length, 1));
  }

  /** Put a tool on the flange: a rod to its tcp. */
  mount(pose) {
    this.tool.matrix.copy(pose);
    span(this.tip, new Vector3(), new Vector3().setFromMatrixPosition(pose), 0.3 * this.radius(this.robot.rows.length));
  }

  /** Put the tool on the flange that is there at a time, or, just before it, at a change. */
  mountAt(time, before = false) {
    const change = this.robot.changes?.findLast((one) => (before ? one.time < time - 1e-9 : one.time <= time));
    if (this.robot.changes) this.mount(matrix((change ?? this.robot).tool));
  }

  fixed(parent, pose) {
    const node = new Group();
    node.matrixAutoUpdate = false;
    node.matrix.copy(pose);
    parent.add(node);
    return node;
  }

  /** Add the meshes that move with a row, 0 for the base; return whether there are any. */
  dress(parent, row) {
    const own = this.meshes.filter((mesh) => mesh.row === row);
    if (own.length) parent.add(...own.map((mesh) => partOf(mesh, this.materials)));
    return own.length > 0;
  }

  foot(parent) {
    const radius = this.radius(0);
    parent.add(rod(this.materials.dark, [0, 0, -0.2 * radius], [0, 0, 0.35 * radius], 1.75 * radius));
  }

  link(parent, row, index) {
    const screw = new Matrix4().makeRotationX(row.alpha).setPosition(row.a, 0, 0);
    if (row.beta) screw.multiply(new Matrix4().makeRotationY(row.beta));
    // Modified rows have their screw about x before the joint: its length a is a part of the link before.
    const before = row.modified ? this.fixed(parent, screw) : parent;
    const radius = this.radius(index);
    if (row.modified && row.a) parent.add(rod(this.materials.link, [0, 0, 0], [row.a, 0, 0], 0.8 * radius));
    const turning = new Group();
    turning.rotation.z = row.theta;
    before.add(turning);
    const slide = mesh(CYLINDER, this.materials.link);
    turning.add(slide);
    const carried = new Group();
    turning.add(carried);
    const end = row.modified ? carried : this.fixed(carried, screw);
    const dressed = this.dress(end, index + 1);
    if (dressed) turning.remove(slide);
    else this.knuckle(row, index, before, turning);
    if (!row.modified && row.a && !dressed) carried.add(rod(this.materials.link, [0, 0, 0], [row.a, 0, 0], 0.8 * radius));
    this.joints.push({ row, turning, carried, slide, radius: row.prismatic ? 0.55 * radius : 0.8 * radius });
    this.showFrame(end);
    return end;
  }

  /** Draw the joint itself: a ball with its axis, or a box that the link slides through. */
  knuckle(row, index, before, turning) {
    const radius = this.radius(index);
    const part = mesh(row.prismatic ? BOX : SPHERE, row.prismatic ? this.materials.prismatic : this.materials.joint);
    part.scale.setScalar(row.prismatic ? 2.5 * radius : 1.12 * radius);
    turning.add(part);
    if (!row.prismatic) before.add(rod(this.materials.dark, [0, 0, -1.3 * radius], [0, 0, 1.3 * radius], 0.5 * radius));
  }

  showFrame(node) {
    if (!this.frames) return;
    const axes = axesOf(0.11 * this.size);
    axes.visible = false;
    node.add(axes);
    this.axes.push(axes);
  }

  /** Move to joint values, rad or m. */
  move(values) {
    this.joints.forEach(({ row, turning, carried, slide, radius }, index) => {
      const change = row.sign * values[index];
      const d = row.prismatic ? row.d + change : row.d;
      turning.rotation.z = row.prismatic ? row.theta : row.theta + change;
      carried.position.z = d;
      span(slide, new Vector3(), new Vector3(0, 0, d), radius);
    });
    this.root.updateMatrixWorld(true);
  }

  /** Return where the tcp stands in the world as it is drawn, m. */
  toolPosition() {
    return new Vector3().setFromMatrixPosition(this.tool.matrixWorld);
  }

  /** Return points around the joints, the tcp and its axes in the world, m: nothing of the arm is outside of them. */
  extremes() {
    const size = 1.5 * this.radius(0);
    const around = ({ x, y, z }) => [-size, size].flatMap((step) => [new Vector3(x + step, y, z), new Vector3(x, y + step, z), new Vector3(x, y, z + step)]);
    const nodes = [...this.joints.flatMap(({ turning, carried }) => [turning, carried]), this.tool];
    const ends = [0, 1, 2].map((axis) => new Vector3().setComponent(axis, 0.1 * this.size).applyMatrix4(this.tool.matrixWorld));
    return [...nodes.flatMap((node) => around(new Vector3().setFromMatrixPosition(node.matrixWorld))), ...ends];
  }
}
