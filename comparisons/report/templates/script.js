"use strict";
const all = (selector, root = document) => [...root.querySelectorAll(selector)];

// Show the checks of one verdict, or all.
const chips = all("[data-show]");
for (const chip of chips) chip.onclick = () => {
  const wanted = chip.getAttribute("aria-pressed") === "true" ? null : chip.dataset.show;
  for (const other of chips) other.setAttribute("aria-pressed", String(other.dataset.show === wanted));
  for (const item of all("[data-verdict]")) item.hidden = wanted !== null && item.dataset.verdict !== wanted;
};

// Sort a table by a column: the first press ascending, the second descending.
const compare = (a, b) => (isFinite(a) && isFinite(b) ? a - b : a.localeCompare(b));
for (const table of all("table.overview:not(.glance)")) for (const heading of all("th", table)) heading.onclick = () => {
  const column = heading.cellIndex, key = row => row.cells[column].dataset.sort ?? "";
  const up = heading.getAttribute("aria-sort") !== "ascending";
  for (const other of all("th", table)) other.removeAttribute("aria-sort");
  heading.setAttribute("aria-sort", up ? "ascending" : "descending");
  table.tBodies[0].append(...[...table.tBodies[0].rows].sort((a, b) => (up ? 1 : -1) * compare(key(a), key(b))));
};

// Flip between the real-time picture and the truth in place: the eye sees a change better than a difference.
for (const button of all("button.flip")) {
  const triple = button.closest(".triple"), [image, truth] = [".realtime", ".truth"].map(which => triple.querySelector(which + " img"));
  if (!image || !truth) continue;
  const own = image.getAttribute("src"), caption = triple.querySelector(".realtime figcaption"), title = caption.textContent;
  button.hidden = false;
  button.onclick = () => {
    const flipped = button.getAttribute("aria-pressed") !== "true";
    button.setAttribute("aria-pressed", String(flipped));
    image.src = flipped ? truth.getAttribute("src") : own;
    caption.textContent = flipped ? "Truth, in its place" : title;
  };
}

// A link to a panel inside closed details opens them.
const reveal = () => {
  const target = document.getElementById(location.hash.slice(1));
  const details = target?.closest("details");
  if (details && !details.open) { details.open = true; target.scrollIntoView(); }
};
addEventListener("hashchange", reveal);
reveal();
