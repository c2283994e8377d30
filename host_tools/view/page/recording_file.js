// A recording as a table: what this page exports, and what `kmax record`, `kmax capture` and the contact experiment write.

/** Throws an Error that says what is wrong with `text` and what would do. `axis`: of a table of several. */
export function parseRecording(name, text, axis) {
  const lines = text.split(/\r?\n/);
  const facts = [];
  let at = 0;
  for (; lines[at]?.startsWith("#"); ++at) facts.push(lines[at].slice(1).trim());
  const heading = (lines[at++] ?? "").split(",");
  const column = (wanted) => {
    const place = [`axis${axis}_${wanted}`, wanted].map((one) => heading.indexOf(one)).find((found) => found >= 0);
    if (place === undefined) throw new Error(`${name}: there is no column ${wanted} in "${heading.join(",").slice(0, 80)}"; take an export of this page, or a file of kmax record, or of kmax capture --channels position,force`);
    return place;
  };
  const places = { time: column("time_s"), position: column("position_m"), force: column("force_n") };
  const recording = { name, facts, wall: wallOf(facts), time: [], position: [], force: [] };
  for (; at < lines.length; ++at) {
    if (!lines[at]) continue;
    const fields = lines[at].split(",");
    // A recording that was cut off ends within a line.
    if (fields.length < heading.length && at === lines.length - 1) break;
    for (const [signal, place] of Object.entries(places)) {
      const field = fields[place];
      const value = field ? Number(field) : NaN;
      if (!Number.isFinite(value)) throw new Error(`${name}, line ${at + 1}: "${field ?? ""}" is no number`);
      recording[signal].push(value);
    }
  }
  if (recording.time.length < 2) throw new Error(`${name}: it has no two rows`);
  return recording;
}

/** {position (m), side}, where the comments say it: "wall.position = 0.004 m". */
function wallOf(facts) {
  const value = (name) => Number(facts.find((line) => line.match(`^(axis\\d\\.)?${name} = `))?.match(/ = (\S+)/)[1] ?? NaN);
  const wall = { position: value("wall\\.position"), side: value("wall\\.side") };
  return Number.isFinite(wall.position) && wall.side ? wall : null;
}

/** m outside the surface, negative inside. */
export function distances({ position }, wall) {
  return position.map((one) => (one - wall.position) * wall.side);
}

/** s of the first row inside the wall; without one, of the first row. */
export function touchTime({ time }, distance) {
  return time[Math.max(0, distance.findIndex((one) => one <= 0))];
}
