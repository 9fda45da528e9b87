// Numbers for people.

/** Return a number with a given count of significant digits, without an exponent where one can do without. */
export function significant(value, digits = 4) {
  if (!Number.isFinite(value)) return '';
  const size = Math.abs(value);
  if (size < 1e-12) return '0';
  if (size >= 1e6 || size < 1e-4) return value.toExponential(digits - 1);
  const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(size)));
  return value.toFixed(Math.min(decimals, 6)).replace('-', '\u2212');
}

/** Return a value of a column, where all have as many decimals as the largest needs. */
export function aligned(value, largest) {
  const whole = Math.max(0, Math.floor(Math.log10(Math.max(largest, 1e-9))));
  const decimals = Math.min(Math.max(3 - whole, 0), 6);
  return fixed(value, decimals);
}

/** Return a value with so many decimals; what is rounded to zero has no sign. */
export function fixed(value, decimals) {
  const text = Math.abs(value).toFixed(decimals);
  return (value < 0 && Number(text) !== 0 ? '\u2212' : '') + text;
}

/** Return how many units of a quantity of a joint make one in SI: efforts are shown in SI. */
export const scaleOf = (joint, quantity) => (quantity === 'tau' ? 1 : joint.scale);

/** Return a time in s, with three decimals. */
export function seconds(time) {
  return `${Math.abs(time) < 5e-4 ? '0.000' : time.toFixed(3)}`;
}
