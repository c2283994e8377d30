// Light or dark: as the system has it, until the switch says otherwise.

const KEY = "kmax-theme";

export function followTheme(button, changed) {
  const system = matchMedia("(prefers-color-scheme: dark)");
  const stored = () => localStorage.getItem(KEY);
  const apply = () => {
    document.documentElement.dataset.theme = stored() ?? (system.matches ? "dark" : "light");
    changed();
  };
  button.onclick = () => {
    localStorage.setItem(KEY, document.documentElement.dataset.theme === "dark" ? "light" : "dark");
    apply();
  };
  system.onchange = apply;
  apply();
}

/** A colour of style.css, for what is drawn. */
export function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}
