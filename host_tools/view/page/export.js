// A table of what the scope holds, which says where it is from: it can be read without this page, and told from others.

import { SIGNALS } from "/rows.js";

const HEADINGS = { position: "position_m", velocity: "velocity_m_per_s", force: "force_n", current: "current_a" };

/** Lines of comment: when, by which program of which commit, of which device and firmware, with which parameters. */
function provenance(device, axis, values, what) {
  const prefix = axis ? `axis${axis}.` : "";
  const own = Object.entries(values).filter(([name]) => (axis ? name.startsWith(prefix) : !/^axis\d/.test(name)));
  const identity = Object.values(device.identification).join(", ");
  return [
    `date: ${new Date().toISOString()}`,
    ...device.program.split("\n").map((line, i) => (i ? `that program's ${line}` : `program: kmax view of ${line}`)),
    `device: ${device.address} (${identity}), axis ${axis}`,
    `firmware: ${device.identification.revision}`,
    `data: ${what}`,
    ...own.map(([name, { value, unit }]) => `${name} = ${value} ${unit}`.trim()),
  ].map((line) => `# ${line}`);
}

/** The rows that are held, oldest first. */
function rollingTable(rows) {
  const names = Object.keys(SIGNALS);
  const lines = [`time_s,tick,${names.map((name) => HEADINGS[name]).join(",")},flags`];
  const first = rows.tick[rows.at(rows.length - 1)];
  for (let back = rows.length - 1; back >= 0; --back) {
    const place = rows.at(back);
    const time = ((rows.tick[place] - first) / rows.tickRate).toFixed(5);
    lines.push([time, rows.tick[place], ...names.map((name) => rows[name][place]), rows.flags[place]].join(","));
  }
  return lines;
}

function captureTable(taken) {
  const lines = [`time_s,${taken.channels.map((channel) => channel.heading).join(",")}`];
  for (let i = 0; i < taken.samples; ++i) {
    const time = ((i - taken.trigger_sample) * taken.interval_ticks) / taken.tick_rate_hz;
    lines.push([time.toFixed(6), ...taken.channels.map((channel) => channel.values[i])].join(","));
  }
  return lines;
}

/** The table as a text, and a name for it. `taken`: the capture that is shown, or null for the rows. */
export function tableOf({ device, axis, values, rows, taken }) {
  const what = taken ? `capture, trigger ${taken.trigger}` : `the last ${rows.length} rows`;
  const lines = [...provenance(device, axis, values, what), ...(taken ? captureTable(taken) : rollingTable(rows))];
  return { name: `kmax_${new Date().toISOString().slice(0, 19).replaceAll(":", "")}.csv`, text: `${lines.join("\n")}\n` };
}

/** Offers the file to the browser. */
export function offer({ name, text }) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
  link.download = name;
  link.click();
  URL.revokeObjectURL(link.href);
}
