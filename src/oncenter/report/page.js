// Text and axes of the plots follow the page from light to dark; on a touch screen a drag scrolls the page.
const restyle = () => {
  const css = getComputedStyle(document.documentElement);
  const text = css.getPropertyValue("--muted").trim();
  const grid = css.getPropertyValue("--grid").trim();
  for (const model of Bokeh.documents.flatMap((document) => document.roots()).flatMap((root) => [...root.references()])) {
    if (model.type.endsWith("Axis")) {
      model.setv({axis_label_text_color: text, major_label_text_color: text, axis_line_color: grid,
                  major_tick_line_color: grid});
    } else if (model.type === "Label") {
      model.setv({text_color: text});
    } else if (model.type === "Toolbar" && matchMedia("(pointer: coarse)").matches) {
      model.setv({active_drag: null});
    }
  }
};
const whenDrawn = () => (Bokeh.documents.length ? restyle() : setTimeout(whenDrawn, 20));
whenDrawn();
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", restyle);

// A picture keeps the size in which it was drawn, which is too wide for paper where the window is wider.
const PRINTED_PX = 680; // of an A4 page less margins and paddings
addEventListener("beforeprint", () => {
  const pictures = [...document.querySelectorAll(".bk-Figure")];
  const fit = Math.min(1, PRINTED_PX / Math.max(...pictures.map((picture) => picture.clientWidth), 1));
  for (const picture of pictures) picture.style.setProperty("--fit", fit);
});
