// The criteria's verdicts in words: which fails, by how much, and what would mend it.

import { element, swatch } from "/elements.js";
import { styleOf } from "/map_view.js";
import { digits, withUnit } from "/units.js";

export class Criteria {
  /** `set(name, value)` is called for a remedy that is chosen. */
  constructor(box, set) {
    this.box = box;
    this.set = set;
  }

  show(judgement) {
    const text = JSON.stringify(judgement);
    if (text === this.shown && document.documentElement.dataset.theme === this.theme) return;
    this.shown = text;
    this.theme = document.documentElement.dataset.theme;
    this.box.replaceChildren(this.verdict(judgement), ...this.list(judgement));
  }

  verdict(judgement) {
    const failed = judgement.criteria.filter((one) => one.applies && !one.pass).length;
    const judged = judgement.criteria.filter((one) => one.applies).length;
    const words = judgement.guaranteed ? "Stable with every passive hand"
      : failed ? `${failed} of ${judged} criteria fail` : `All ${judged} criteria that apply are met`;
    return element("p", { className: `verdict ${failed ? "fails" : "holds"}` }, element("b", {}, failed ? "✗ " : "✓ "), words);
  }

  list(judgement) {
    const rows = judgement.criteria.map((one, place) => ({ one, place })).filter(({ one }) => one.applies);
    rows.sort((a, b) => a.one.pass - b.one.pass);
    return rows.map(({ one, place }) => element("div", { className: "criterion" }, swatch(styleOf(place)),
      element("div", {},
        element("b", {}, one.name.replaceAll("_", " ")), ` ${one.worth}, ${one.pass ? "met" : "fails"}`,
        element("span", { className: "quiet" }, this.numbers(one)),
        ...one.changes.slice(0, 2).map((change) => this.remedy(change)))));
  }

  numbers(one) {
    if (one.value === null || one.bound === null) return "";
    const relation = one.at_least ? "≥" : "≤";
    return ` ${withUnit(one.value, one.unit)}, ${one.pass ? "is" : "should be"} ${relation} ${withUnit(one.bound, one.unit)}`;
  }

  remedy(change) {
    const words = `${change.parameter} ${change.at_least ? "at least" : "at most"} ${withUnit(change.value, change.unit)}`;
    if (change.only_if_true) return element("div", { className: "remedy" }, `${words}, if that is true of the device`);
    const button = element("button", { type: "button", className: "plain small", title: `Set ${change.parameter} to ${digits(change.value)} ${change.unit}` }, "set");
    button.onclick = () => this.set(change.parameter, change.value);
    return element("div", { className: "remedy" }, words, " ", button);
  }
}
