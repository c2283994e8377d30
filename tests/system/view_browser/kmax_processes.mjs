// The programs under test, each with what it prints.
import { spawn, spawnSync } from "node:child_process";
import { existsSync } from "node:fs";

export const KMAX = process.env.KMAX ?? "build/native/kmax";
export const PATIENCE = 240_000;  // ms, for what comes in a moment unless the machine is slow; success does not wait for it

/** Until `look` gives something true, which is returned. */
export async function until(what, look) {
  for (const end = Date.now() + PATIENCE; Date.now() < end; await new Promise((resolve) => setTimeout(resolve, 20))) {
    const found = await look();
    if (found) return found;
  }
  throw new Error(`not within ${PATIENCE / 1000} s: ${what}`);
}

function started(command, ...parts) {
  const child = spawn(command, parts);
  const running = { child, said: "", ended: new Promise((resolve) => child.on("exit", resolve)) };
  for (const pipe of [child.stdout, child.stderr]) pipe.on("data", (data) => { running.said += data; });
  running.end = async (signal = "SIGTERM") => {
    child.kill(signal);
    await running.ended;
  };
  return running;
}

/** A device on a bus at a Unix socket: `device` is its command, in which BUS stands for the socket. */
export async function device(command, bus) {
  const running = started(...command.map((part) => part.replace("BUS", bus)));
  running.child.on("exit", (code) => code && console.error(running.said));
  // Over the bus like anybody else: the image takes its time to start.
  await until(`${command.join(" ")} answers`, () => existsSync(bus) && (kmax(bus, "get", "info.tick", "--json")?.["info.tick"].value ?? 0) > 6000);
  return running;
}

export async function view(bus) {
  const running = started(KMAX, "view", "--device", `can:${bus}`, "--json");
  running.address = await until("kmax view says where it is", () => {
    if (running.child.exitCode !== null) throw new Error(running.said);
    try {
      return JSON.parse(running.said.slice(0, running.said.indexOf("}") + 1));
    } catch {
      return null;
    }
  });
  return running;
}

/** What another kmax says of the device; null if it could not. */
export function kmax(bus, ...parts) {
  const done = spawnSync(KMAX, [...parts, "--device", `can:${bus}`], { encoding: "utf8" });
  return done.status === 0 ? JSON.parse(done.stdout) : null;
}
