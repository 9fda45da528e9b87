// How much of its limits each joint uses: the largest part of any limit at a time.
import { element } from './dom.js';
import { scaleOf, significant } from './numbers.js';

const WORDS = { qd: ['velocity', 1], qdd: ['acceleration', 2], qddd: ['jerk', 3], tau: ['effort', 4] };
const OVER = 1.0005; // what is above has passed its limit: values are packed to one part in 65,000

/** Return the limits in force at a time: at a border those of the later move. */
export function limitsAt(limits, time) {
  return limits.findLast(({ start }) => start <= time + 1e-9) ?? limits[0];
}

/** Return { share, quantity, value, limit } of the limit of which a joint uses most at a time; undefined where it has none. */
export function largestUse(scene, motion, joint, time) {
  const bounds = limitsAt(scene.limits, time)?.bounds;
  let most;
  for (const [quantity, [, order]] of Object.entries(WORDS)) {
    const pair = bounds?.[order]?.[joint];
    if (!pair || !motion.values[quantity]) continue;
    const value = motion.value(quantity, joint, time);
    const limit = value < 0 ? pair[0] : pair[1];
    const share = limit === null || limit === 0 ? undefined : value / limit;
    if (share !== undefined && !(most && most.share >= share)) most = { share, quantity, value, limit };
  }
  return most;
}

/** A bar for a joint: as long as the part that it uses, and which limit that is. */
export class UseBar {
  constructor(scene, motion, joint) {
    Object.assign(this, { scene, motion, joint });
    this.fill = element('span.use-fill');
    this.text = element('span.use-text');
    this.element = element('div.use-bar', { role: 'meter', 'aria-valuemin': 0, 'aria-valuemax': 100, 'aria-label': `use of the limits of ${scene.joints[joint].name}` }, this.fill, this.text);
  }

  update(time) {
    const use = largestUse(this.scene, this.motion, this.joint, time);
    this.element.hidden = !use;
    if (!use) return;
    const { share, quantity, value, limit } = use;
    const [word, order] = WORDS[quantity];
    const { units } = this.scene.joints[this.joint];
    const scale = scaleOf(this.scene.joints[this.joint], quantity);
    const percent = Math.round(100 * share);
    this.fill.style.width = `${Math.min(100 * share, 100).toFixed(1)}%`;
    this.element.classList.toggle('full', share > 0.9995 && share <= OVER);
    this.element.classList.toggle('over', share > OVER);
    this.text.textContent = `${percent} %`;
    this.element.title = `${word}: ${significant(value * scale, 4)} of ${significant(limit * scale, 4)} ${units[order]}, ${percent} % used`;
    this.element.setAttribute('aria-valuenow', percent);
    this.element.setAttribute('aria-valuetext', this.element.title);
  }
}

/** Whether any limit of a derivative or an effort is known. */
export const hasUses = (scene, motion) => scene.limits.some(({ bounds }) =>
  Object.entries(WORDS).some(([quantity, [, order]]) => motion.values[quantity] && bounds[order]?.flat().some((bound) => bound !== null)));
