// The page of `trajcli view`: its parts, and what they have to do with each other.
import { Clock } from './clock.js';
import { ICONS, element, icon } from './dom.js';
import { helpDialog, listenToKeys } from './keyboard.js';
import { Motion } from './motion.js';
import { JointTable, findingPanels, reportPanels } from './panels.js';
import { Plots } from './plots.js';
import { Stage } from './stage.js';
import { Status } from './status.js';
import { Theme } from './theme.js';
import { Transport } from './timeline.js';

const PARTS = [['ghosts', 'Ghosts', 'Ghosts of the arm at waypoints (g)'], ['frames', 'Frames', 'Frames of the links (f)'], ['trace', 'Path', 'Path of the tool (t)'], ['zones', 'Zones', 'Zones about corners, and the programmed path in them (z)'], ['other', 'Second', 'The second motion (c)'], ['grid', 'Grid', 'Grid (r)']];
const VIEWS = [['corner', '0'], ['front', '1'], ['side', '2'], ['top', '3']];

function toggle(label, title, pressed, onchange) {
  const button = element('button.chip', { type: 'button', title, 'aria-pressed': pressed, text: label, onclick: () => {
    const now = button.getAttribute('aria-pressed') !== 'true';
    button.setAttribute('aria-pressed', now);
    onchange(now);
  } });
  return button;
}

function header(scene, theme, dialog) {
  const round = (name, label, onclick) => element('button.round', { type: 'button', 'aria-label': label, title: label, onclick }, icon(...ICONS[name]));
  const facts = element('span.facts', { text: scene.subtitle });
  const verdict = ({ state, text }) => element(`span.verdict.${state}`, { text });
  const titled = scene.other
    ? [element('div.compared', {}, ...[scene, scene.other].map((one, index) =>
      element('div.motion', {}, element(`span.${index ? 'ghostly' : 'solid'}`, { title: index ? 'the translucent arm, thin curves' : 'the solid arm, thick curves' }), element('h1', { text: one.title }), element('span.facts', { text: one.subtitle }), verdict(one.verdict))))]
    : [element('div.title', {}, element('h1', { text: scene.title }), facts), verdict(scene.verdict)];
  return element('header', {},
    ...titled,
    round('theme', 'Dark or light (d)', () => theme.toggle()),
    round('help', 'Help (?)', () => dialog.showModal()));
}

/** Return the view in space with its buttons; or why there is none. */
function viewport(scene, motion, theme, other) {
  const holder = element('div.viewport');
  const without = (reason) => {
    holder.classList.add('empty');
    holder.replaceChildren(element('p', { text: reason }));
    return { holder };
  };
  if (!scene.robot) return without(scene.no_geometry);
  try {
    const stage = new Stage(holder, scene, motion, theme, other);
    const hidden = new Set(['frames', ...(scene.other ? ['ghosts'] : [])]);
    const chips = PARTS.filter(([part]) => (part !== 'zones' || scene.zones.length) && (part !== 'other' || scene.other)).map(([part, label, title]) => [part, toggle(label, title, !hidden.has(part), (on) => stage.show(part, on))]);
    if (scene.other) stage.show('ghosts', false);
    const reset = element('button.chip.reset', { type: 'button', title: 'See everything (0)', 'aria-label': 'See everything', onclick: () => stage.look('corner') }, icon(...ICONS.reset));
    const cell = element('span.cell', { text: `grid ${Number((stage.cell * scene.length.scale).toPrecision(3))} ${scene.length.unit}` });
    holder.append(element('div.chips', {}, ...chips.map(([, chip]) => chip), reset), element('div.legend', {}, stage.trace.legend, cell));
    return { holder, stage, chips: Object.fromEntries(chips) };
  } catch (error) {
    return without(`This browser does not draw in three dimensions (${error.message}): plots only.`);
  }
}

function keysOf(clock, scene, { stage, chips }, theme, dialog, { jerk, apart }) {
  const move = (step) => {
    const starts = scene.moves.map(({ start }) => start);
    const next = step > 0 ? starts.find((start) => start > clock.time + 1e-9) : starts.findLast((start) => start < clock.time - 1e-9);
    clock.seek(next ?? (step > 0 ? clock.end : clock.start));
  };
  const actions = {
    ' ': () => clock.toggle(),
    ArrowLeft: (event) => clock.step(event.shiftKey ? -10 : -1),
    ArrowRight: (event) => clock.step(event.shiftKey ? 10 : 1),
    ArrowUp: () => move(-1),
    ArrowDown: () => move(1),
    Home: () => clock.seek(clock.start),
    End: () => clock.seek(clock.end),
    '+': () => clock.faster(1),
    '=': () => clock.faster(1),
    '-': () => clock.faster(-1),
    l: () => {
      clock.loop = !clock.loop;
      clock.changed();
    },
    d: () => theme.toggle(),
    j: () => jerk?.click(),
    p: () => apart.click(),
    '?': () => dialog.showModal(),
  };
  if (stage) {
    for (const [view, key] of VIEWS) actions[key] = () => stage.look(view);
    for (const [key, part] of [['g', 'ghosts'], ['f', 'frames'], ['t', 'trace'], ['r', 'grid'], ['z', 'zones'], ['c', 'other']]) actions[key] = () => chips[part]?.click();
  }
  return actions;
}

function start(scene) {
  const theme = new Theme();
  const motion = new Motion(scene);
  const other = scene.other && new Motion(scene.other, motion.start);
  const clock = new Clock(motion.start, Math.max(motion.end, other?.end ?? motion.end));
  const dialog = helpDialog();
  const view = viewport(scene, motion, theme, other);
  const status = new Status(scene, clock, view.stage);
  const plots = new Plots(scene, motion, clock, theme, other);
  const table = new JointTable(scene, motion, plots, clock, theme, other);
  const limits = toggle('All limits', 'Zoom out until every limit can be seen', false, (on) => plots.setAllLimits(on));
  const apart = toggle('Joints apart', 'A plot for each joint (p)', plots.apart, (on) => plots.setApart(on));
  const jerk = plots.hasJerk ? toggle('Jerk', 'Plot of the jerk (j)', false, (on) => plots.showJerk(on)) : undefined;
  const bar = element('div.bar', {}, element('h2', { text: 'Joints' }), element('div.chips', {}, ...(scene.joints.length > 1 ? [apart] : []), limits, ...(jerk ? [jerk] : [])));
  const side = element('aside', {}, ...findingPanels(scene, clock), bar, table.element, plots.holder, ...reportPanels(scene, clock), element('footer', { text: scene.made_by }));
  document.body.classList.toggle('flat', !view.stage);
  document.body.append(header(scene, theme, dialog), element('main', {}, view.holder, status.element, new Transport(scene, clock).element), side, dialog);
  plots.rebuild();
  if (view.stage) {
    clock.listen(() => view.stage.seek(clock.time));
    view.stage.resize();
    view.stage.look('corner');
  }
  clock.listen(() => status.update());
  listenToKeys(keysOf(clock, scene, view, theme, dialog, { jerk, apart }));
  clock.seek(scene.opens_at ?? clock.start);
  globalThis.trajcli = {
    clock,
    motion,
    plots,
    other,
    stage: view.stage,
    seek: (time) => clock.seek(time),
    joints: (time) => motion.joints(time),
    /** Seek to a time, and return where the tcp stands as it is drawn, m. */
    toolPosition: (time) => {
      clock.seek(time);
      return view.stage?.arm.toolPosition().toArray();
    },
  };
  requestAnimationFrame(() => requestAnimationFrame(() => (globalThis.trajcli.ready = true)));
}

start(JSON.parse(document.getElementById('scene').textContent));
