// The first time that a page uses a word of the glossary, its meaning shows under the pointer. GLOSSARY comes from words.js.
"use strict";

const UNMARKED = "a, abbr, code, pre, .math, h1, h2, h3, h4";
const SENTENCES = "article p, article li";

function mark(node, words) {
  const found = words.exec(node.data);
  if (!found) return null;
  const word = node.splitText(found.index);
  word.splitText(found[0].length);
  const abbreviation = document.createElement("abbr");
  abbreviation.title = GLOSSARY[found[0].toLowerCase()] ?? GLOSSARY[found[0]];
  word.replaceWith(abbreviation);
  abbreviation.append(word);
  return found[0];
}

addEventListener("DOMContentLoaded", () => {
  if (location.pathname.endsWith("/glossary.html")) return;
  const texts = [];
  for (const sentence of document.querySelectorAll(SENTENCES)) {
    const walker = document.createTreeWalker(sentence, NodeFilter.SHOW_TEXT);
    while (walker.nextNode()) if (!walker.currentNode.parentElement.closest(UNMARKED)) texts.push(walker.currentNode);
  }
  // Long words first: "control period" before "controller".
  for (const word of Object.keys(GLOSSARY).sort((a, b) => b.length - a.length)) {
    const words = new RegExp(`\\b${word}\\b`, "i");
    texts.some((node) => !node.parentElement?.closest("abbr") && mark(node, words));
  }
});
