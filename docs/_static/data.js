// Data files: below a link to a CSV file its rows as a table, chosen by what stands in their columns of words. A column that is the same in all of them is left out.
"use strict";

const ALL = "all";
const UNCHOSEN = ["unit"]; // columns of words that follow from another one

// Lines without line breaks in quotes, which is all that the commands write.
function fields(line) {
  return [...line.matchAll(/(?:^|,)(?:"((?:[^"]|"")*)"|([^,]*))/g)].map(([, quoted, plain]) => quoted?.replaceAll('""', '"') ?? plain);
}

function element(tag, content, properties = {}) {
  const made = document.createElement(tag);
  made.append(...content);
  return Object.assign(made, properties); // last: a choice has no value before it has its options
}

// A choice per column of words that differ; at first the first of each, and all of the last column.
function choices(head, rows, show) {
  const words = head.flatMap((title, column) => {
    const values = [...new Set(rows.map((row) => row[column]))];
    const numbers = values.some((value) => Number.isFinite(worth(value)));
    return numbers || UNCHOSEN.includes(title) ? [] : [{ title, column, values }];
  });
  const chosen = words.map(({ title, column, values }, index) => {
    const options = [ALL, ...values].map((value) => element("option", [value]));
    const select = element("select", options, { value: index === words.length - 1 ? ALL : values[0] });
    select.addEventListener("change", update);
    return { column, select, label: element("label", [`${title} `, select]) };
  });
  function update() {
    const fixed = chosen.filter(({ select }) => select.value !== ALL);
    const same = new Set(fixed.map(({ column }) => column));
    show((row) => fixed.every(({ column, select }) => row[column] === select.value), same);
  }
  update();
  return chosen.map(({ label }) => label);
}

function view(text) {
  const [titles, ...all] = text.trim().split("\n").map(fields);
  const differing = titles.map((_, column) => new Set(all.map((row) => row[column])).size > 1);
  const own = (row) => row.filter((_, column) => differing[column]);
  const [head, rows] = [own(titles), all.map(own)];
  const lines = rows.map((row) => element("tr", row.map((cell) => element("td", [cell]))));
  const heads = head.map((title) => element("th", [title.replaceAll("_", " ")]));
  const table = element("table", [element("thead", [element("tr", heads)]), element("tbody", lines)], { className: "docutils" });
  addSorting(table);
  const counted = element("span", [], { className: "data-count" });
  const labels = choices(head, rows, (holds, same) => {
    lines.forEach((line, index) => (line.hidden = !holds(rows[index])));
    for (const line of table.rows) [...line.cells].forEach((cell, column) => (cell.hidden = same.has(column)));
    counted.textContent = `${lines.filter((line) => !line.hidden).length} of ${lines.length} rows`;
  });
  const wrapper = element("div", [table], { className: "table-wrapper" });
  return element("div", [element("div", [...labels, counted], { className: "data-choices" }), wrapper], { className: "data-view" });
}

addEventListener("DOMContentLoaded", () => {
  for (const script of document.querySelectorAll('script[type="text/csv"]')) {
    document.querySelector(`article a[href$="/${script.title}"]`).closest("p").after(view(script.textContent));
  }
});
