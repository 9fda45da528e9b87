// What is known of the motion: findings, events, moves, and the joints now.
import { element } from './dom.js';
import { aligned, scaleOf, seconds, significant } from './numbers.js';
import { UseBar, hasUses } from './use.js';

const ORDERS = ['q', 'qd', 'qdd', 'qddd', 'tau'];
const FEW = 60; // lines of a list that are made at once

/** Return a list whose lines seek to their time. */
function list(items, clock, kind) {
  const line = ({ time, message, hint, label }) =>
    element('li', {}, element(`button.line.${kind}`, { type: 'button', onclick: () => clock.seek(time) },
      element('span.when', { text: `${seconds(time)} s` }),
      element('span.what', {}, label ? element('b', { text: `${label} ` }) : '', message, hint ? element('span.hint', { text: hint }) : '')));
  const made = element('ul.lines', {}, ...items.slice(0, FEW).map(line));
  if (items.length > FEW) {
    const more = element('button.more', { type: 'button', text: `${items.length - FEW} more`, onclick: () => {
      more.remove();
      made.append(...items.slice(FEW).map(line));
    } });
    return element('div', {}, made, more);
  }
  return made;
}

/** Return a list of findings, one line for each cause: the worst of it, and the others where they are asked for. */
function causeList({ findings, causes }, clock) {
  return element('div', {}, ...causes.map(([worst, ...others]) => {
    const line = list([findings[worst]], clock, 'bad');
    if (!others.length) return line;
    const more = element('details.alike', {}, element('summary', { text: `and ${others.length} more of this cause` }));
    more.addEventListener('toggle', () => more.children.length < 2 && more.append(list(others.map((index) => ({ ...findings[index], hint: null })), clock, 'bad')), { once: true });
    return element('div', {}, line, more);
  }));
}

function section(title, count, content, open = true) {
  const heading = element('summary', {}, element('h2', { text: title }), element('span.count', { text: count }));
  return element('details.panel', { open }, heading, content);
}

/** Return the section of the findings: what comes first; nothing where there are none. */
export function findingPanels(scene, clock) {
  return scene.causes.length ? [section('Findings', scene.causes.length, causeList(scene, clock))] : [];
}

/** Return the sections of events, notes, moves and steps; those without lines are left out. */
export function reportPanels(scene, clock) {
  const panels = [];
  const { events, steps, moves, notes, zones } = scene;
  if (events.length) panels.push(section('Events', events.length, list(events, clock, 'event')));
  if (notes.length) panels.push(section('Notes', notes.length, element('ul.notes', {}, ...notes.map((text) => element('li', { text })))));
  const lines = moves.map(({ start, label, detail }) => ({ time: start, label, message: detail }));
  if (lines.length) panels.push(section('Moves', lines.length, list(lines, clock, 'move-line')));
  if (zones.length) panels.push(section('Zones', zones.length, list(zones, clock, 'zone-line'), zones.length <= 12));
  if (steps.length) panels.push(section('Steps in acceleration', steps.length, list(steps, clock, 'step'), false));
  return panels;
}

/** The joints: their names, which show and hide their curves, and their values now. */
export class JointTable {
  constructor(scene, motion, plots, clock, theme, other) {
    Object.assign(this, { scene, motion, clock, theme, other });
    const quantities = motion.quantities.filter((name) => name !== 'qddd');
    this.largest = Object.fromEntries(quantities.map((name) => [name, motion.values[name].map((_, joint) => {
      const alike = motion.values[name].filter((_, other) => scene.joints[other].units[0] === scene.joints[joint].units[0]);
      const scale = scaleOf(scene.joints[joint], name);
      return Math.max(...alike.map((values) => values.reduce((most, value) => Math.max(most, Math.abs(value * scale)), 0)));
    })]));
    const symbols = { q: 'q', qd: 'q\u0307', qdd: 'q\u0308', tau: '\u03c4' };
    const mixed = new Set(scene.joints.map((joint) => joint.units[0])).size > 1;
    const head = element('tr', {}, element('th', { scope: 'col', text: 'joint' }), ...quantities.map((name) =>
      element('th', { scope: 'col' }, element('span.symbol', { text: symbols[name] }), mixed ? '' : ` ${scene.joints[0].units[ORDERS.indexOf(name)]}`)));
    if (other) head.append(element('th', { scope: 'col', title: 'By how much the second motion is ahead' }, element('span.symbol', { text: '\u0394q' })));
    if (hasUses(scene, motion)) head.append(element('th.use', { scope: 'col', title: 'The largest part of any limit that is used now', text: 'use' }));
    this.cells = [];
    this.differences = other ? scene.joints.map(() => element('td')) : [];
    this.bars = hasUses(scene, motion) ? scene.joints.map((_, index) => new UseBar(scene, motion, index)) : [];
    const rows = scene.joints.map((joint, index) => {
      const swatch = element('span.swatch');
      const button = element('button.joint', { type: 'button', 'aria-pressed': true, title: 'Show or hide its curves', onclick: () => {
        plots.toggleJoint(index);
        button.setAttribute('aria-pressed', !plots.hidden.has(index));
      } }, swatch, element('span', { text: joint.name }), mixed ? element('span.unit', { text: joint.units[0] }) : '');
      const cells = quantities.map((name) => ({ name, index, node: element('td') }));
      this.cells.push(...cells);
      return { swatch, row: element('tr', {}, element('th', { scope: 'row' }, button), ...cells.map(({ node }) => node), ...(other ? [this.differences[index]] : []), ...(this.bars.length ? [element('td.use', {}, this.bars[index].element)] : [])) };
    });
    this.swatches = rows.map(({ swatch }) => swatch);
    this.element = element(`div.joints${quantities.length + (this.bars.length ? 1 : 0) + (other ? 1 : 0) > 3 ? '.many' : ''}`, {}, element('table', {}, element('thead', {}, head), element('tbody', {}, ...rows.map(({ row }) => row))));
    theme.listen(() => this.paint());
    clock.listen(() => this.update());
    this.paint();
    this.update();
  }

  paint() {
    this.swatches.forEach((swatch, index) => {
      const { color, dash } = this.theme.joint(index);
      swatch.style.background = dash.length ? `repeating-linear-gradient(to right, ${color} 0 5px, transparent 5px 8px)` : color;
    });
  }

  update() {
    for (const bar of this.bars) bar.update(this.clock.time);
    const [here, there] = [this.motion, this.other].map((one) => one?.joints(this.clock.time));
    this.differences.forEach((node, index) => {
      const { scale } = this.scene.joints[index];
      node.textContent = significant((there[index] - here[index]) * scale, 3);
    });
    for (const { name, index, node } of this.cells) {
      const scale = scaleOf(this.scene.joints[index], name);
      node.textContent = aligned(this.motion.value(name, index, this.clock.time) * scale, this.largest[name][index]);
    }
  }
}
