// Elements of the page: a short notation for making them.

/**
 * Return a new element.
 * @param {string} tag Its name, with classes: 'button.tool.round'.
 * @param {object} attributes Listeners are called `onclick` and so on; `text` is its text; false leaves one out.
 * @param {...(Node|string)} children What it holds.
 */
export function element(tag, attributes = {}, ...children) {
  const [name, ...classes] = tag.split('.');
  const made = document.createElement(name);
  if (classes.length) made.className = classes.join(' ');
  for (const [key, value] of Object.entries(attributes)) {
    if (key === 'text') made.textContent = value;
    else if (key.startsWith('on')) made.addEventListener(key.slice(2), value);
    else if (key.startsWith('aria-')) made.setAttribute(key, String(value));
    else if (value !== false && value != null) made.setAttribute(key, value === true ? '' : value);
  }
  made.append(...children);
  return made;
}

const SVG = 'http://www.w3.org/2000/svg';

/** Return an icon of 24 by 24 units, drawn by paths; those that begin with `fill ` are filled. */
export function icon(...paths) {
  const svg = document.createElementNS(SVG, 'svg');
  svg.setAttribute('viewBox', '0 0 24 24');
  svg.setAttribute('aria-hidden', 'true');
  svg.classList.add('icon');
  for (const text of paths) {
    const path = document.createElementNS(SVG, 'path');
    path.setAttribute('d', text.replace('fill ', ''));
    if (text.startsWith('fill ')) path.classList.add('filled');
    svg.append(path);
  }
  return svg;
}

export const ICONS = {
  play: ['fill M8 5.5v13l11-6.5z'],
  pause: ['fill M7 5h3.6v14H7z', 'fill M13.4 5H17v14h-3.6z'],
  first: ['fill M18 6v12l-9-6z', 'M6.5 6v12'],
  last: ['fill M6 6v12l9-6z', 'M17.5 6v12'],
  back: ['M14.5 6l-6 6 6 6'],
  forward: ['M9.5 6l6 6-6 6'],
  loop: ['M17 3l3 3-3 3', 'M4 11V9.5A3.5 3.5 0 0 1 7.500 6H20', 'M7 21l-3-3 3-3', 'M20 13v1.500A3.500 3.500 0 0 1 16.500 18H4'],
  theme: ['M12 3.500a8.500 8.500 0 1 0 0 17 8.500 8.500 0 0 0 0-17z', 'fill M12 3.500a8.500 8.500 0 0 1 0 17z'],
  help: ['M9 9.300A3 3 0 1 1 13.500 12c-1 .6-1.500 1.200-1.500 2.300', 'M12 17.500v.2'],
  reset: ['M4 9V4h5', 'M20 9V4h-5', 'M4 15v5h5', 'M20 15v5h-5'],
};
