// What errors say: a value in few words, a name that is like it, and what is allowed.

const LONGEST = 60; // characters of a value
const MOST = 12; // names in a list

/** A value as JSON, shortened. */
export function shown(value) {
  const words = typeof value === "number" && !Number.isFinite(value) ? String(value) : jsonOf(value);
  return words.length > LONGEST ? `${words.slice(0, LONGEST - 4)} ...` : words;
}

function jsonOf(value) {
  try {
    return JSON.stringify(value) ?? String(value);
  } catch {
    return typeof value; // a circle, or a whole number that JSON has none for
  }
}

/** The question that an error asks where `word` is like one that is `known`, else nothing. */
export function near(word, known) {
  if (typeof word !== "string" || word.length > LONGEST) return "";
  const found = known.map((name) => [distance(plain(word), plain(name)), name]).sort(([a], [b]) => a - b)[0];
  return found && found[0] <= Math.max(1, Math.floor(word.length / 4)) ? ` (did you mean ${JSON.stringify(found[1])}?)` : "";
}

const plain = (word) => word.trim().toLowerCase().replaceAll(/[ _]/g, "-");

/** How many letters are to be changed, left out or put in (Levenshtein). */
function distance(one, other) {
  let row = Array.from({ length: other.length + 1 }, (_, k) => k);
  for (let i = 1; i <= one.length; i += 1) {
    const next = [i];
    for (let k = 1; k <= other.length; k += 1) {
      next.push(Math.min(row[k] + 1, next[k - 1] + 1, row[k - 1] + Number(one[i - 1] !== other[k - 1])));
    }
    row = next;
  }
  return row.at(-1);
}

/** Names in a list, the first of many. */
export function listed(names) {
  const more = names.length - MOST;
  return more > 1 ? `${names.slice(0, MOST).join(", ")} and ${more} more` : names.join(", ");
}
