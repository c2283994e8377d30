// How numbers in SI units are shown. A tuning session thinks in N/mm and mm.

const SHOWN = {
  "N/m": { unit: "N/mm", factor: 1e-3 },
  "m": { unit: "mm", factor: 1e3 },
  "m/s": { unit: "mm/s", factor: 1e3 },
};

export function shownUnit(unit) {
  return SHOWN[unit]?.unit ?? unit;
}

export function toShown(value, unit) {
  return value * (SHOWN[unit]?.factor ?? 1);
}

export function fromShown(value, unit) {
  return value / (SHOWN[unit]?.factor ?? 1);
}

/** Three significant digits, without a power of ten. */
export function digits(value, count = 3) {
  if (value === 0 || !Number.isFinite(value)) return String(value);
  return String(Number(value.toPrecision(count)));
}

/** "3.58 N/mm" */
export function withUnit(value, unit, count = 3) {
  return `${digits(toShown(value, unit), count)} ${shownUnit(unit)}`.trim();
}

/** A number whose digits do not move about while it changes. */
export function steady(value, decimals) {
  const text = value.toFixed(decimals);
  return (Number(text) < 0 ? "−" : "\u2007") + text.replace("-", "");
}
