// Where the page comes from: a dialog with paper, licence, version and documentation.

const byId = (id) => document.getElementById(id);

export class About {
  constructor() {
    const dialog = byId("about");
    byId("open-about").addEventListener("click", () => dialog.showModal());
    byId("close-about").addEventListener("click", () => dialog.close());
    // The rig behind it gets no keys.
    dialog.addEventListener("keydown", (event) => event.stopPropagation());
    // A click beside it closes it, too.
    dialog.addEventListener("click", (event) => event.target === dialog && dialog.close());
  }

  setUp({ paper, version }) {
    byId("version").textContent = version;
    byId("paper").textContent = paper.words;
    const link = byId("paper-link");
    link.href = paper.address;
    link.textContent = paper.address.replace("https://", "");
  }
}
