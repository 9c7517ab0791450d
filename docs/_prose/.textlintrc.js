// The rules of `make prose`. The terms come from the glossary: its third column lists the names that a term replaces.
const { readFileSync } = require("node:fs");
const { join } = require("node:path");

const glossary = readFileSync(join(__dirname, "..", "reference", "glossary.md"), "utf8");
const rows = glossary.split("\n").filter((line) => line.startsWith("| ")).map((line) => line.split("|").map((cell) => cell.trim()));
const terms = rows.flatMap(([, entry, , others]) => {
  const term = entry.split(",")[0];
  return [...(others ?? "").matchAll(/`([^`]+)`/g)].map(([, other]) => [`${other}(s?)`, `${term}$1`]);
});
if (!terms.length) throw new Error("docs/reference/glossary.md has no third column of names that are not to be used");

module.exports = {
  // <!-- textlint-disable --> and <!-- textlint-enable --> stand around what is quoted.
  filters: { comments: true },
  rules: {
    terminology: { defaultTerms: false, terms },
    // About 35 words; the name of a quoted figure is none of them.
    "sentence-length": { max: 200, skipPatterns: ["/\\{figure\\}`?[^` ]*`?/", "/<!-- .*? -->/"] },
  },
};
