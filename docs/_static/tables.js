// Sortable tables: a click on the head of a column sorts its rows, up and then down; long tables get a field that filters them.
"use strict";

const SHORT = 4; // rows below which sorting says nothing
const LONG = 30; // rows from which a filter helps

// What a cell is worth: its first number ("lost" is the worst of all), else its words.
function worth(text) {
  const plain = text.trim().replace("−", "-");
  if (/^lost\b/.test(plain)) return Infinity;
  const number = /^[<>≥≤~±]?\s*(-?\d[\d,]*\.?\d*(?:e[+-]?\d+)?)/i.exec(plain);
  return number ? parseFloat(number[1].replace(/,/g, "")) : NaN;
}

function compare(a, b) {
  const [x, y] = [worth(a), worth(b)];
  if (!Number.isNaN(x) && !Number.isNaN(y)) return x === y ? 0 : x - y;
  if (Number.isNaN(x) !== Number.isNaN(y)) return Number.isNaN(x) ? 1 : -1; // words and gaps after numbers
  return a.localeCompare(b);
}

function sort(table, column, head) {
  const up = head.getAttribute("aria-sort") !== "ascending";
  for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
  head.setAttribute("aria-sort", up ? "ascending" : "descending");
  const body = table.tBodies[0];
  const rows = [...body.rows].map((row) => [row.cells[column]?.textContent ?? "", row]);
  rows.sort(([a], [b]) => (up ? compare(a, b) : compare(b, a)));
  body.append(...rows.map(([, row]) => row));
}

function addFilter(table) {
  const field = document.createElement("input");
  const rows = [...table.tBodies[0].rows];
  field.type = "search";
  field.className = "table-filter";
  field.placeholder = `Filter ${rows.length} rows`;
  field.setAttribute("aria-label", field.placeholder);
  field.addEventListener("input", () => {
    const words = field.value.toLowerCase().split(/\s+/);
    for (const row of rows) {
      const text = row.textContent.toLowerCase();
      row.hidden = !words.every((word) => text.includes(word));
    }
  });
  (table.closest(".table-wrapper") ?? table).before(field);
}

function addSorting(table) {
  [...table.tHead.rows[0].cells].forEach((head, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.className = "table-sort";
    button.append(...head.childNodes);
    button.addEventListener("click", () => sort(table, column, head));
    head.append(button);
  });
}

addEventListener("DOMContentLoaded", () => {
  for (const table of document.querySelectorAll("article table.docutils")) {
    const rows = table.tBodies[0]?.rows.length ?? 0;
    if (!table.tHead?.textContent.trim() || rows < SHORT) continue;
    if (rows >= LONG) addFilter(table);
    // A table of words alone is in an order that its writer chose.
    if ([...table.tBodies[0].querySelectorAll("td")].every((cell) => Number.isNaN(worth(cell.textContent)))) continue;
    addSorting(table);
  }
});
