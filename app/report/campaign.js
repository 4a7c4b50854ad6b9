"use strict";
// Filters and sorts the table of runs, and opens a run that a link leads to.
const find = (id) => document.getElementById(id);
const body = document.querySelector("#table tbody");
const lines = [...body.rows].map((row) => ({ row, text: row.textContent.toLowerCase(), failed: row.classList.contains("unmet") }));

function filter() {
  const words = find("filter").value.toLowerCase().split(/\s+/).filter(Boolean);
  const failed = find("failed-only").checked;
  let count = 0;
  for (const line of lines) {
    line.row.hidden = !(words.every((word) => line.text.includes(word)) && (line.failed || !failed));
    count += !line.row.hidden;
  }
  find("found").textContent = words.length || failed ? `${count} of ${lines.length} runs` : "";
}
find("filter").addEventListener("input", filter);
find("failed-only").addEventListener("change", filter);

document.querySelectorAll("button.sort").forEach((button, column) => button.addEventListener("click", () => {
  const head = button.parentElement, down = head.getAttribute("aria-sort") === "ascending";
  document.querySelectorAll("th[aria-sort]").forEach((other) => other.removeAttribute("aria-sort"));
  head.setAttribute("aria-sort", down ? "descending" : "ascending");
  const key = ({ row }) => row.cells[column].textContent;
  const order = (a, b) => key(a).localeCompare(key(b), "en", { numeric: true }) * (down ? -1 : 1);
  body.append(...[...lines].sort(order).map((line) => line.row));
}));

function open() {
  const target = location.hash.startsWith("#run-") && find(location.hash.slice(1));
  if (target) { target.open = true; target.scrollIntoView(); }
}
window.addEventListener("hashchange", open);
open();
