// A table of what the scope holds, which says where it is from: it can be read without this page, and told from others.

import { SIGNALS } from "/rows.js";

const HEADINGS = { position: "position_m", velocity: "velocity_m_per_s", force: "force_n", current: "current_a" };

/** Lines of comment: when, by which program, of which device, with which parameters. */
function provenance(device, axis, values, what) {
  const prefix = axis ? `axis${axis}.` : "";
  const own = Object.entries(values).filter(([name]) => (axis ? name.startsWith(prefix) : !/^axis\d/.test(name)));
  const identity = Object.values(device.identification).join(", ");
  return [
    `date: ${new Date().toISOString()}`,
    `program: kmax view ${device.version}`,
    `device: ${device.address} (${identity}), axis ${axis}`,
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

/** Offers the file to the browser. `taken`: the capture that is shown, or null for the rows. */
export function exportTable({ device, axis, values, rows, taken }) {
  const what = taken ? `capture, trigger ${taken.trigger}` : `the last ${rows.length} rows`;
  const lines = [...provenance(device, axis, values, what), ...(taken ? captureTable(taken) : rollingTable(rows))];
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([`${lines.join("\n")}\n`], { type: "text/csv" }));
  link.download = `kmax_${new Date().toISOString().slice(0, 19).replaceAll(":", "")}.csv`;
  link.click();
  URL.revokeObjectURL(link.href);
}
