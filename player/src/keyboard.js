// Keys of the player, and the page that explains them.
import { element } from './dom.js';

const HELP = [
  ['space', 'play, pause'],
  ['\u2190  \u2192', 'one frame back, on (shift: ten)'],
  ['Home  End', 'to the start, to the end'],
  ['\u2191  \u2193', 'to the move before, to the next move'],
  ['+  \u2212', 'faster, slower'],
  ['l', 'repeat'],
  ['0  1  2  3', 'view from the corner, front, side, top'],
  ['g  f  t  r  z', 'ghosts, frames, tool path, grid, zones'],
  ['c', 'the second of two motions'],
  ['j', 'jerk'],
  ['p', 'a plot for each joint'],
  ['d', 'dark or light'],
  ['?', 'this page'],
];
const MOUSE = [
  ['drag', 'turn the view; right button or two fingers: move it'],
  ['wheel, pinch', 'zoom'],
  ['click in a plot', 'go to that time'],
  ['drag in a plot', 'zoom to an interval; double click: everything'],
  ['click a line of the report', 'go to its time'],
];

export function helpDialog() {
  const rows = (pairs) => pairs.map(([keys, what]) => element('tr', {}, element('th', { scope: 'row', text: keys }), element('td', { text: what })));
  const close = element('button', { type: 'button', text: 'Close', onclick: () => dialog.close() });
  const dialog = element('dialog.help', { 'aria-label': 'Help' }, element('h2', { text: 'Keys' }), element('table', {}, ...rows(HELP)),
    element('h2', { text: 'Mouse and touch' }), element('table', {}, ...rows(MOUSE)), close);
  dialog.addEventListener('click', (event) => event.target === dialog && dialog.close());
  return dialog;
}

/** Listen to keys; what an element in focus does with a key comes first. */
export function listenToKeys(actions) {
  addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const inFocus = event.target.closest?.('select, input, dialog');
    const pressesButton = event.target.closest?.('button, summary') && (event.key === ' ' || event.key === 'Enter');
    const action = actions[event.key];
    if (!action || inFocus || pressesButton) return;
    event.preventDefault();
    action(event);
  });
}
