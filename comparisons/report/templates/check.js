"use strict";
// The way through the checks that the reader chose on the overview: it stands behind the page's name, "?effect=eye".
const chosen = readSelection(location.search);
const step = { back: document.querySelector(".back"), prev: document.querySelector("[rel=prev]"), next: document.querySelector("[rel=next]") };

if (chosen) {
  const own = decodeURIComponent(location.pathname.split("/").pop().replace(/\.html$/, ""));
  const way = inOrder(CHECKS.filter(check => isSelected(check, chosen)), chosen);
  const here = way.findIndex(check => check.name === own), query = "?" + writeSelection(chosen);
  const lead = (link, check) => check ? link.setAttribute("href", encodeURIComponent(check.name) + ".html" + query) : link.removeAttribute("href");
  step.back.hash = writeSelection(chosen);
  if (here >= 0) {
    lead(step.prev, way[here - 1]);
    lead(step.next, way[here + 1]);
    document.getElementById("place").textContent = `${here + 1} of ${way.length} chosen`;
  }
}

// What changes with every run stands in a script of its own, so that a page is written anew only if its check changed.
if (RUN) document.getElementById("run").textContent = RUN;

const KEY_STEPS = { j: step.next, k: step.prev, o: step.back };
addEventListener("keydown", event => {
  const isElsewhere = event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey;
  if (isElsewhere || event.target.closest?.("input, select, textarea")) return;
  if (KEY_STEPS[event.key]?.hasAttribute("href")) KEY_STEPS[event.key].click();
});

// The clipboard is not open to every page from a file; the selection is.
const copy = async code => {
  try {
    await navigator.clipboard.writeText(code.textContent);
    return true;
  } catch {
    getSelection().selectAllChildren(code);
    return document.execCommand("copy");
  }
};

for (const button of document.querySelectorAll(".copy")) button.onclick = async () => {
  const done = await copy(button.parentElement.querySelector("code"));
  button.textContent = done ? "Copied" : "Press Ctrl+C";
  button.parentElement.querySelector("[role=status]").textContent = button.textContent;
};
