"use strict";
const all = (selector, root = document) => [...root.querySelectorAll(selector)];
const form = document.querySelector(".filters"), chips = all(".chip"), headings = all("th [data-sort]");
const tables = all("table.checks"), parity = document.getElementById("parity");
const rowOf = new Map(tables.flatMap(table =>
  [...table.tBodies[0].rows].map((row, number) => [CHECKS[Number(table.dataset.first) + number], row])));
let selection = NOTHING_CHOSEN;

const change = part => show({ ...selection, ...part });

const show = wanted => {
  const isResorted = wanted.sort !== selection.sort;
  selection = wanted;
  if (isResorted) for (const table of tables) sortRows(table);
  const address = writeSelection(selection);
  for (const [check, row] of rowOf) row.hidden = !isSelected(check, selection);
  history.replaceState(null, "", address ? "#" + address : location.pathname + location.search);
  showControls();
  showCounts();
};

const sortRows = table => {
  const own = [...rowOf.keys()].filter(check => rowOf.get(check).closest("table") === table);
  table.tBodies[0].append(...inOrder(own, selection).map(check => rowOf.get(check)));
};

const showControls = () => {
  for (const field of form.elements) if (field.name && field.value !== selection[field.name]) field.value = selection[field.name];
  for (const chip of chips) chip.setAttribute("aria-pressed", String(chip.dataset.verdict === selection.verdict));
  for (const heading of headings) {
    const cell = heading.closest("th"), key = heading.dataset.sort;
    const order = { [key]: "ascending", ["-" + key]: "descending" }[selection.sort];
    if (order) cell.setAttribute("aria-sort", order); else cell.removeAttribute("aria-sort");
  }
};

const showCounts = () => {
  const count = isParity => {
    const own = CHECKS.filter(check => check.parity === isParity);
    return [own.filter(check => isSelected(check, selection)).length, own.length];
  };
  const [light, lights] = count(false), [same, sames] = count(true);
  const says = [lights ? `${light} of ${lights} checks` : "", sames ? `${same} of ${sames} of parity` : ""];
  form.querySelector("output").textContent = says.filter(Boolean).join(", ");
  document.querySelector(".nothing-matches").hidden = light + same > 0;
  if (parity && !light && same) parity.open = true;
};

// Numbers are most telling with the largest on top, words from A on.
const firstOrder = key => (typeof CHECKS.find(check => check[key] !== null)?.[key] === "string" || key === "severity" ? "" : "-");

for (const heading of headings) heading.onclick = () => {
  const key = heading.dataset.sort, first = firstOrder(key) + key, second = firstOrder(key) ? key : "-" + key;
  change({ sort: selection.sort === first ? second : first });
};

for (const chip of chips) chip.onclick = () => {
  change({ verdict: selection.verdict === chip.dataset.verdict ? "" : chip.dataset.verdict });
  reveal();
};

// What was filtered should be seen.
const reveal = () => {
  if (form.getBoundingClientRect().bottom > innerHeight - 100) form.scrollIntoView();
};

// A link to a check takes along what was chosen, so that its page leads on among those.
for (const kind of ["pointerdown", "focusin"]) addEventListener(kind, event => {
  const link = event.target.closest?.(".checks a");
  if (link) link.search = writeSelection(selection);
});

if (form) {
  form.oninput = event => change({ [event.target.name]: event.target.value });
  form.onsubmit = event => event.preventDefault();
  form.onreset = event => { event.preventDefault(); show(NOTHING_CHOSEN); };
  document.querySelector(".nothing-matches .reset").onclick = () => { show(NOTHING_CHOSEN); form.elements.text.focus(); };
  const readAddress = () => {
    const wanted = readSelection(location.hash);
    if (wanted) show(wanted);
    if (parity && location.hash === "#parity") parity.open = true;
    return wanted !== null;
  };
  addEventListener("hashchange", () => { if (readAddress()) reveal(); });
  if (!readAddress()) show(NOTHING_CHOSEN);
  // "/" goes to the text field, as in many lists.
  addEventListener("keydown", event => {
    if (event.key === "/" && !event.target.matches("input, select")) { event.preventDefault(); form.elements.text.focus(); }
  });
}
