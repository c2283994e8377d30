// What is put into the page.

export function element(tag, attributes = {}, ...children) {
  const made = Object.assign(document.createElement(tag), attributes);
  made.append(...children);
  return made;
}

/** A piece of a line: `{colour, dashes}`. */
export function swatch({ colour, dashes }) {
  const line = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  line.setAttribute("viewBox", "0 0 24 8");
  line.setAttribute("class", "swatch");
  line.setAttribute("aria-hidden", "true");
  const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  path.setAttribute("d", "M0 4H24");
  path.setAttribute("stroke", colour);
  path.setAttribute("stroke-width", "3");
  path.setAttribute("stroke-dasharray", dashes.join(" "));
  line.append(path);
  return line;
}
