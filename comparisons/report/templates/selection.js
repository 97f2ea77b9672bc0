"use strict";
// Which checks a reader wants to see, and in which order. It stands in addresses: "effect=eye&text=talk&sort=-error".
const FACETS = ["effect", "scene", "technique", "verdict"];
const KEYS = [...FACETS, "text", "sort"];

// An address without any key, such as that of a heading, says nothing: null.
const readSelection = address => {
  const found = new URLSearchParams(address.replace(/^[#?]/, ""));
  const selection = Object.fromEntries(KEYS.map(key => [key, found.get(key) ?? ""]));
  return KEYS.some(key => found.has(key)) ? selection : null;
};

const NOTHING_CHOSEN = readSelection("text=");

const writeSelection = selection =>
  new URLSearchParams(KEYS.filter(key => selection[key]).map(key => [key, selection[key]])).toString();

const isSelected = (check, selection) =>
  FACETS.every(name => !selection[name] || check[name] === selection[name]) &&
  selection.text.toLowerCase().split(/\s+/).every(word => check.text.includes(word));

// What has no value comes last in either direction.
const compareBy = sort => {
  const key = sort.replace(/^-/, ""), sign = sort.startsWith("-") ? -1 : 1;
  return (a, b) => {
    const [x, y] = [a[key] ?? null, b[key] ?? null];
    if (x === null || y === null) return (x === null) - (y === null);
    return sign * (typeof x === "string" ? x.localeCompare(y) : x - y);
  };
};

// Checks of light first, those of parity behind them, as on the overview.
const inOrder = (checks, selection) => {
  const order = selection.sort ? compareBy(selection.sort) : () => 0;
  return [...checks].sort((a, b) => a.parity - b.parity || order(a, b));
};
