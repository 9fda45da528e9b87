// Words in the view in space: elements over the picture, each where its place is drawn.
import { Vector3 } from 'three';
import { element } from './dom.js';

const GAP = 8; // px: from a place to its words

export class Labels {
  constructor(holder) {
    this.element = element('div.labels', { 'aria-hidden': true });
    holder.append(this.element);
    this.all = [];
  }

  /**
   * Add words at a place that `where` returns, in the world; the first added win where two overlap.
   * @returns {object} The label: `hidden` hides it.
   */
  add(text, where, kind = '') {
    const label = { node: element(`span.label${kind && `.${kind}`}`, { text }), where, hidden: false };
    this.element.append(label.node);
    this.all.push(label);
    return label;
  }

  /** Put all labels where a camera sees their places, in a picture of a size in px. */
  place(camera, width, height) {
    const taken = [];
    for (const label of this.all) {
      const { x, y, z } = label.where().clone().project(camera);
      label.size ??= [label.node.offsetWidth, label.node.offsetHeight];
      const [wide, high] = label.size;
      const [left, top] = [(0.5 + 0.5 * x) * width + GAP, (0.5 - 0.5 * y) * height - high / 2];
      const box = [left, top, left + wide, top + high];
      const inside = z < 1 && left > 0 && top > 0 && box[2] < width && box[3] < height;
      const free = taken.every((other) => box[2] < other[0] || other[2] < box[0] || box[3] < other[1] || other[3] < box[1]);
      const shown = !label.hidden && inside && free;
      label.node.style.visibility = shown ? 'visible' : 'hidden';
      if (!shown) continue;
      taken.push(box);
      label.node.style.transform = `translate(${left.toFixed(1)}px, ${top.toFixed(1)}px)`;
    }
  }
}

/** Return where a point of an object stands in the world. */
export const worldPlace = (object) => () => new Vector3().setFromMatrixPosition(object.matrixWorld);
