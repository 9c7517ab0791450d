// The paper's symbols as text: ["F", "us,x"] is F with an index, a string stands as it is.

/** One element for a formula such as [["x", "c"], " \u2212 ", ["x", "t"]]. */
export function formula(parts) {
  const element = document.createElement("span");
  element.className = "symbol";
  for (const part of parts) {
    if (typeof part === "string") {
      element.append(part);
      continue;
    }
    const [letter, index] = part;
    const symbol = document.createElement("var");
    symbol.textContent = letter;
    element.append(symbol);
    if (!index) continue;
    const below = document.createElement("sub");
    below.textContent = index;
    element.append(below);
  }
  return element;
}
