// Messages that appear, stay long enough to be read, and fade.

const SHOWN = 7000; // ms
const FADE = 600; // ms, as in style.css
const MOST = 4;

export class Notices {
  constructor(element) {
    this.element = element;
  }

  show(words) {
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
