// Plots of the joints over time: linked to each other and to the clock, with limits, moves and findings.
import uPlot from 'uplot';
import { element } from './dom.js';
import { scaleOf, seconds, significant } from './numbers.js';

const NAMES = { q: 'Position', qd: 'Velocity', qdd: 'Acceleration', qddd: 'Jerk', tau: 'Effort', dq: 'Difference' };
const SYMBOLS = { q: 'q', qd: 'q\u0307', qdd: 'q\u0308', qddd: 'q\u20db', tau: '\u03c4', dq: '\u0394q' };
const ORDERS = ['q', 'qd', 'qdd', 'qddd', 'tau'];
const NEAR = 1.6; // times the range of the curves: a limit that is nearer is always in view
const HEIGHT = { beside: 168, alone: 240, apart: 104 }; // of a plot, px: beside the view in space, without one, of one joint
const LONG = 60; // s: of a longer motion each joint has plots of its own at first

/** Return the number of the limits and units of a quantity: a difference is a position. */
const orderOf = (quantity) => Math.max(ORDERS.indexOf(quantity), 0);

export class Plots {
  /**
   * @param {object} scene What the page shows.
   * @param {Motion} motion The motion of the joints.
   * @param {Clock} clock What a click seeks with.
   * @param {Theme} theme The colours.
   * @param {Motion} other A second motion, drawn thin and light beside the first; undefined without one.
   */
  constructor(scene, motion, clock, theme, other) {
    Object.assign(this, { scene, motion, clock, theme, other });
    this.quantities = [...motion.quantities, ...(other ? ['dq'] : [])];
    this.hidden = new Set();
    this.allLimits = false;
    this.height = HEIGHT[scene.robot ? 'beside' : 'alone'];
    this.holder = element('div.plots');
    this.jerk = false;
    this.apart = motion.end - motion.start > LONG && scene.joints.length > 1;
    this.layOut();
    theme.listen(() => this.rebuild());
    clock.listen(() => this.moveCursors());
    new ResizeObserver(() => this.resize()).observe(this.holder);
  }

  /** Make the cards anew: one for each quantity, or one for each joint. */
  layOut() {
    for (const { plot } of this.cards ?? []) plot?.destroy();
    this.holder.replaceChildren();
    this.holder.classList.toggle('apart', this.apart);
    const all = this.scene.joints.map((_, index) => index);
    this.cards = this.quantities.flatMap((quantity) => (this.apart ? all.map((joint) => this.card(quantity, [joint])) : [this.card(quantity, all)]));
    this.showJerk(this.jerk);
  }

  /** Give each joint plots of its own, or not. */
  setApart(apart) {
    this.apart = apart;
    this.layOut();
  }

  card(quantity, joints) {
    const room = element('div.plot-room');
    const limit = this.scene.limits.some(({ bounds }) => (bounds[quantity === 'dq' ? -1 : orderOf(quantity)] ?? []).flat().some((bound) => bound !== null));
    const key = limit ? [element('span.limit-key', { text: 'limit' })] : [];
    const name = this.apart ? `${this.scene.joints[joints[0]].name} ` : `${NAMES[quantity]} `;
    const heading = element('h3', {}, element('span', {}, name, element('span.symbol', { text: SYMBOLS[quantity] })), ...key);
    const card = element('section.plot', { 'aria-label': `${NAMES[quantity]} of ${this.apart ? this.scene.joints[joints[0]].name : 'the joints'} over time`, 'data-quantity': quantity }, heading, room);
    this.holder.append(card);
    return { quantity, joints, card, room, order: orderOf(quantity) };
  }

  /** Draw all plots anew: colours, ranges or joints have changed. */
  rebuild() {
    for (const card of this.cards) {
      card.plot?.destroy();
      card.plot = undefined;
      if (!card.card.hidden) this.draw(card);
    }
    this.moveCursors();
  }

  showJerk(visible) {
    this.jerk = visible;
    for (const card of this.cards) card.card.hidden = (card.quantity === 'qddd' && !visible) || (this.apart && this.hidden.has(card.joints[0]));
    this.rebuild();
  }

  get hasJerk() {
    return this.cards.some((card) => card.quantity === 'qddd');
  }

  toggleJoint(index) {
    if (!this.hidden.delete(index)) this.hidden.add(index);
    this.showJerk(this.jerk);
  }

  setAllLimits(all) {
    this.allLimits = all;
    this.rebuild();
  }

  /** Return the units of a plot: joints of another unit have an axis of their own, at the right. */
  unitsOf({ joints, order }) {
    return [...new Set(joints.map((joint) => this.scene.joints[joint].units[order]))];
  }

  /** Return the times and the values of all joints in their units; made once, for all cards. */
  dataOf(quantity) {
    this.data ??= {};
    if (quantity === 'dq') this.data.dq ??= this.differences();
    this.data[quantity] ??= [this.motion.times, ...this.scene.joints.map((joint, index) => Array.from(this.motion.values[quantity][index], (value) => value * scaleOf(joint, quantity)))];
    return this.data[quantity];
  }

  /** Return the times of the first motion, and by how much the second is ahead, in the units of the joints. */
  differences() {
    const { joints } = this.scene;
    const columns = joints.map(() => new Array(this.motion.count));
    this.motion.times.forEach((time, row) => {
      const there = this.other.joints(time);
      joints.forEach(({ scale }, joint) => (columns[joint][row] = (there[joint] - this.motion.values.q[joint][row]) * scale));
    });
    return [this.motion.times, ...columns];
  }

  /** Draw the curves of the second motion: thinner, and lighter. */
  drawOther(plot, card) {
    const columns = card.quantity === 'dq' ? undefined : this.other?.values[card.quantity];
    if (!columns) return;
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.globalAlpha = 0.55;
    ctx.lineWidth = devicePixelRatio;
    for (const joint of this.shown(card)) {
      const { units } = this.scene.joints[joint];
      const scale = scaleOf(this.scene.joints[joint], card.quantity);
      ctx.strokeStyle = this.theme.joint(joint).color;
      ctx.beginPath();
      this.other.times.forEach((time, row) => {
        const at = [plot.valToPos(time, 'x', true), plot.valToPos(columns[joint][row] * scale, units[card.order], true)];
        if (row) ctx.lineTo(...at);
        else ctx.moveTo(...at);
      });
      ctx.stroke();
    }
    ctx.restore();
  }

  draw(card) {
    const { quantity, room, order } = card;
    const { joints } = this.scene;
    const units = this.unitsOf(card);
    const width = Math.max(room.clientWidth, 120);
    const data = this.dataOf(quantity);
    const series = joints.map((joint, index) => {
      const { color, dash } = this.theme.joint(index);
      return { label: joint.name, scale: joint.units[order], stroke: color, dash, width: 1.7, pxAlign: 0, points: { show: false }, show: card.joints.includes(index) && !this.hidden.has(index) };
    });
    const scales = Object.fromEntries(units.map((unit) => [unit, { range: () => this.range(data, card, unit) }]));
    const axis = { stroke: this.theme.css('--muted'), font: '11px system-ui, sans-serif', labelFont: '11px system-ui, sans-serif', grid: { stroke: this.theme.css('--rule'), width: 1 }, ticks: { show: false } };
    const axes = units.map((unit, k) => ({ ...axis, scale: unit, side: k ? 1 : 3, size: 52, label: unit, labelSize: 14, labelGap: 0, grid: { ...axis.grid, show: k === 0 }, values: ticksOf('') }));
    card.plot = new uPlot(
      {
        width,
        height: this.apart ? HEIGHT.apart : this.height,
        padding: [8, units.length > 1 ? 0 : 20, 0, 0],
        legend: { show: false },
        cursor: { sync: { key: 'trajcli' }, y: false, points: { size: 6 }, drag: { x: true, y: false, dist: 6 }, dataIdx: nearest },
        scales: { x: { time: false, range: (plot, low, high) => this.timeRange(low, high) }, ...scales },
        axes: [{ ...axis, size: 26, gap: 3, space: 56, values: ticksOf(' s') }, ...axes],
        series: [{}, ...series],
        hooks: {
          drawAxes: [(plot) => this.drawBorders(plot)],
          draw: [(plot) => this.drawOther(plot, card), (plot) => this.drawLimits(plot, card), (plot) => this.drawFindings(plot, card)],
          setCursor: [(plot) => this.showValues(card, plot)],
          setSelect: [(plot) => (this.zoomed = plot.select.width > 0)],
          setScale: [(plot, key) => key === 'x' && this.followZoom(plot)],
        },
      },
      data,
      room,
    );
    card.cursor = element('div.playhead');
    card.values = element('div.values', { hidden: true });
    card.plot.over.append(card.cursor, card.values);
    this.listen(card);
  }

  /** Show the values under the pointer, beside it; in the plot that it is over. */
  showValues(card, plot) {
    const { values } = card;
    const { left, idx } = plot.cursor;
    values.hidden = !(left >= 0 && idx !== null && idx !== undefined && plot.over.matches(':hover'));
    if (values.hidden) return;
    const lines = this.shown(card).map((joint) => {
      const name = element('span.value-name', { text: this.scene.joints[joint].name });
      const mark = element('span.swatch');
      mark.style.background = this.theme.joint(joint).color;
      return element('div', {}, mark, name, element('b', { text: significant(plot.data[joint + 1][idx], 4) }));
    });
    const row = plot.data[0][idx];
    values.replaceChildren(element('div.value-time', { text: `${seconds(row)} s, ${this.unitsOf(card).join(' and ')}` }), ...lines);
    const beyond = left > plot.over.clientWidth / 2;
    values.style.left = beyond ? 'auto' : `${left + 12}px`;
    values.style.right = beyond ? `${plot.over.clientWidth - left + 12}px` : 'auto';
  }

  timeRange(low, high) {
    const { start, end } = this.clock;
    return low === null || high - low < 1e-9 ? [start, end > start ? end : start + 1] : [low, high];
  }

  /** A click seeks; dragging zooms, and a double click shows everything. */
  listen({ plot }) {
    let down = 0;
    plot.over.addEventListener('pointerdown', (event) => (down = event.clientX));
    plot.over.addEventListener('click', (event) => {
      if (Math.abs(event.clientX - down) < 6) this.clock.seek(plot.posToVal(event.offsetX, 'x'));
    });
  }

  /** Show the same interval of time in all plots. */
  followZoom(from) {
    if (this.following) return;
    this.following = true;
    const { min, max } = from.scales.x;
    for (const { plot } of this.cards) {
      if (plot && plot !== from && (plot.scales.x.min !== min || plot.scales.x.max !== max)) plot.setScale('x', { min, max });
    }
    this.following = false;
    requestAnimationFrame(() => this.moveCursors());
  }

  /** Return the range of an axis: of the curves in view, and of the limits that are near, or of all limits. */
  range(data, card, unit) {
    const { order } = card;
    let [low, high] = [Infinity, -Infinity];
    const shown = this.shown(card, unit);
    for (const joint of shown) for (const value of data[joint + 1]) [low, high] = [Math.min(low, value), Math.max(high, value)];
    for (const joint of shown) {
      const scale = scaleOf(this.scene.joints[joint], card.quantity);
      for (const value of this.other?.values[card.quantity]?.[joint] ?? []) [low, high] = [Math.min(low, value * scale), Math.max(high, value * scale)];
    }
    if (low > high) return [-1, 1];
    const room = Math.max(high - low, Math.max(Math.abs(low), Math.abs(high)) * (order ? 1 : 0.1), 1e-6);
    const [least, most] = this.allLimits ? [-Infinity, Infinity] : [(low + high) / 2 - (NEAR * room) / 1.6, (low + high) / 2 + (NEAR * room) / 1.6];
    for (const { value } of this.limits(card, shown)) {
      if (value >= least && value <= most) [low, high] = [Math.min(low, value), Math.max(high, value)];
    }
    const margin = 0.06 * Math.max(high - low, 1e-6);
    return [low - margin, high + margin];
  }

  shown({ joints, order }, unit) {
    return joints.filter((index) => !this.hidden.has(index) && (!unit || this.scene.joints[index].units[order] === unit));
  }

  /** Return the limits of joints: value, interval of time, joints that have it. */
  limits({ order, quantity }, joints) {
    if (quantity === 'dq') return [];
    const lines = new Map();
    for (const { start, end, bounds } of this.scene.limits) {
      for (const joint of joints) {
        for (const bound of bounds[order]?.[joint] ?? []) {
          if (bound === null) continue;
          const { units } = this.scene.joints[joint];
          const scale = scaleOf(this.scene.joints[joint], ORDERS[order]);
          const key = [start, bound * scale, units[order]].join();
          if (!lines.has(key)) lines.set(key, { value: bound * scale, start, end, unit: units[order], joints: [] });
          lines.get(key).joints.push(joint);
        }
      }
    }
    return [...lines.values()];
  }

  drawLimits(plot, card) {
    const { order } = card;
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.lineWidth = 1.25 * devicePixelRatio;
    ctx.setLineDash([5 * devicePixelRatio, 4 * devicePixelRatio]);
    for (const { value, start, end, unit, joints } of this.limits(card, this.shown(card))) {
      ctx.strokeStyle = joints.length > 1 ? this.theme.css('--limit') : this.theme.joint(joints[0]).color;
      const y = plot.valToPos(value, unit, true);
      ctx.beginPath();
      ctx.moveTo(plot.valToPos(start, 'x', true), y);
      ctx.lineTo(plot.valToPos(end, 'x', true), y);
      ctx.stroke();
    }
    ctx.restore();
  }

  drawBorders(plot) {
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.strokeStyle = this.theme.css('--border');
    ctx.lineWidth = devicePixelRatio;
    for (const { start } of this.scene.moves.slice(1)) {
      const x = Math.round(plot.valToPos(start, 'x', true));
      if (x <= bbox.left || x >= bbox.left + bbox.width) continue;
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
    }
    ctx.restore();
  }

  /** Mark where a limit is broken by a triangle on the curve. */
  drawFindings(plot, { order, joints, quantity }) {
    const { ctx } = plot;
    const size = 5 * devicePixelRatio;
    ctx.save();
    ctx.fillStyle = this.theme.css('--bad');
    for (const { time, order: of, joint, value } of this.scene.findings) {
      if (quantity === 'dq' || of !== order || !joints.includes(joint) || this.hidden.has(joint)) continue;
      const { units } = this.scene.joints[joint];
      const scale = scaleOf(this.scene.joints[joint], ORDERS[order]);
      const [x, y] = [plot.valToPos(time, 'x', true), plot.valToPos(value * scale, units[order], true)];
      ctx.beginPath();
      ctx.arc(x, y, size, 0, 2 * Math.PI);
      ctx.fill();
    }
    ctx.restore();
  }

  moveCursors() {
    const { time } = this.clock;
    for (const { plot, cursor } of this.cards) {
      if (!plot) continue;
      const x = plot.valToPos(time, 'x');
      cursor.hidden = !(x >= -0.5 && x <= plot.over.clientWidth + 0.5);
      cursor.style.transform = `translateX(${x}px)`;
    }
  }

  resize() {
    for (const { plot, room } of this.cards) {
      const width = room.clientWidth;
      if (plot && width > 0 && width !== plot.width) plot.setSize({ width, height: plot.height });
    }
    this.moveCursors();
  }
}

/** Return a function that writes the values of ticks with a unit behind, with as many decimals as they need. */
function ticksOf(unit) {
  return (_plot, ticks, _axis, _space, step) => {
    const decimals = Math.min(Math.max(-Math.floor(Math.log10(step) + 1e-9), 0), 9);
    return ticks.map((tick) => `${tick.toFixed(decimals)}${unit}`.replace('-', '\u2212'));
  };
}

/** Return the row that the cursor shows: of two rows of one time the later one. */
function nearest(plot, series, index) {
  const times = plot.data[0];
  return times[index + 1] === times[index] ? index + 1 : index;
}
