// Messages that appear, stay long enough to be read, and fade.

const SHOWN = 7000; // ms
const FADE = 600; // ms, as in style.css
const MOST = 4;
const GAP = 10; // px below the upper edge of the rig's picture

export class Notices {
  constructor(element) {
    this.element = element;
  }

  /** It appears where the rig is, so that it covers no button. */
  show(words) {
    const { top } = document.querySelector(".view").getBoundingClientRect();
    this.element.style.top = `${Math.max(top, 0) + GAP}px`;
    const same = [...this.element.children].find((notice) => notice.textContent === words);
    same?.remove();
    const notice = document.createElement("p");
    notice.textContent = words;
    this.element.append(notice);
    while (this.element.children.length > MOST) this.element.firstElementChild.remove();
    setTimeout(() => notice.classList.add("fading"), SHOWN);
    setTimeout(() => notice.remove(), SHOWN + FADE);
  }
}
