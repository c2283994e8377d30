#!/usr/bin/env node
// The live page in a browser, against a device on a bus. Each step prints a line.
// usage: page_check.mjs all|short COMMAND...        COMMAND starts the device; BUS in it is the bus's socket
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { createServer } from "node:http";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { arm, launch, open } from "./browser.mjs";
import { KMAX, PATIENCE, device, kmax, until, view } from "./kmax_processes.mjs";

const [extent, ...command] = process.argv.slice(2);
const folder = mkdtempSync(join(tmpdir(), "kmax-view-"));
const bus = join(folder, "bus");
const browser = await launch();
// On a busy machine kmax view may not run for a whole second (link.timeout), and the device would then remove the force.
const patientDevice = async () => {
  const started = await device(command, bus);
  assert.ok(kmax(bus, "set", "link.timeout=30", "--json"));
  return started;
};
let running = await patientDevice();
let served = await view(bus);
let page = await open(browser, served.address.url);
page.setDefaultTimeout(PATIENCE);

const stateIs = (name, on = page) => on.waitForSelector(`#state[data-state=${name}]`);
// As the stream says it. Another program is asked only while nothing is armed: it has the link to itself for as long as it
// takes, and on a slow machine that may be longer than link.timeout.
const armed = () => page.heard.state.axes[0].armed;
const field = (name) => page.locator(`#field-${name.replaceAll(".", "-")}`);
const value = (name) => page.heard.parameters.values[name].value;
/** Asked at intervals: frames, at which Playwright asks otherwise, may stand still where there is no screen and little time. */
const eventually = (on, condition, argument) => on.waitForFunction(condition, argument, { polling: 100 });
const set = async (name, text) => {
  await field(name).fill(text);
  await field(name).press("Tab");
};
let exported;  // the file
/** Presses the start of a procedure until it has begun. */
const hold = async (name) => {
  const button = page.locator(`#start-${name}`);
  await button.scrollIntoViewIfNeeded();
  await eventually(page, (id) => !document.getElementById(id).disabled, `start-${name}`);
  const box = await button.boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  await page.waitForSelector("#prompt:not([hidden])");
  await page.mouse.up();
};
/** The person lets go when the force is off: until the handle is out of the wall, it cannot be armed. */
const outside = () => until("the handle is out of the wall", () =>
  (page.heard.rows.axes[0].position.at(-1) - value("wall.position")) * Number(value("wall.side")) > 1e-3);

const steps = {
  async "a fresh page says what there is"() {
    await stateIs("disarmed");
    assert.equal(await page.locator("#state-words").textContent(), "Disarmed");
    assert.match(await page.locator("#device").textContent(), /Kmax/);
    await eventually(page, () => document.querySelector("#criteria .verdict"));
  },
  async "sliders set the device, and the drawn law follows"() {
    await page.click("summary");
    await set("wall.stiffness_ceiling", "5");
    await set("wall.stiffness", "2");
    await until("stiffness is set", () => value("wall.stiffness") === 2000);
    const times = [];
    for (const k of [2.5, 3, 3.5, 3]) {
      const began = performance.now();
      await page.evaluate((shown) => {
        const slider = document.querySelector(".slider input[type=range]");
        slider.value = shown;
        slider.dispatchEvent(new Event("input"));
      }, k);
      await until("stiffness and the law follow the slider", () => value("wall.stiffness") === 1e3 * k && page.heard.curve);
      times.push(Math.round(performance.now() - began));
    }
    console.log(`   after ${times.join(", ")} ms`);
    assert.equal(kmax(bus, "get", "wall.stiffness", "--json")["wall.stiffness"].value, 3000);
    await eventually(page, () => document.querySelector(".slider.changed"));
  },
  async "what another program sets is shown"() {
    assert.ok(kmax(bus, "set", "wall.damping=0.5", "--json"));
    await eventually(page, () => document.getElementById("field-wall-damping").value === "0.5");
  },
  async "a press that does not last arms nothing, and one that loses the focus stops"() {
    const box = await page.locator("#arm").boundingBox();
    await page.mouse.move(box.x + 10, box.y + 10);
    await page.mouse.down();
    await page.mouse.up();
    await page.mouse.down();
    await page.evaluate(() => window.dispatchEvent(new Event("blur")));
    await eventually(page, () => document.getElementById("banner").textContent.includes("STOP was asked for"));
    await page.mouse.up();
    assert.equal(armed(), false);
  },
  async "held, it arms; the person presses, the loop shows it"() {
    await outside();
    await arm(page);
    assert.equal(await page.locator("#arm-words").textContent(), "Disarm");
    await eventually(page, () => Number.parseFloat(document.getElementById("loop-values").textContent.split("mm")[1].replace("−", "-")) > 0.2);
    assert.ok(await page.locator("#law").isDisabled());
  },
  async "stiffness is dragged while armed, up to its ceiling"() {
    await page.evaluate(() => {
      const slider = document.querySelector(".slider input[type=range]");
      for (const k of [3.2, 3.5, 4]) {
        slider.value = k;
        slider.dispatchEvent(new Event("input"));
      }
    });
    await until("stiffness follows the slider", () => value("wall.stiffness") === 4000);
    await set("wall.stiffness", "6");
    await eventually(page, () => document.getElementById("said").textContent.includes("wall.stiffness_ceiling"));
    assert.equal(value("wall.stiffness"), 4000);
    await eventually(page, () => document.getElementById("field-wall-stiffness").value === "4");
  },
  async "the space bar stops, with the focus anywhere"() {
    await field("wall.damping").focus();
    await page.keyboard.press("Space");
    await stateIs("stopped");
    assert.equal(armed(), false);
    assert.match(await page.locator("#banner").textContent(), /answered after/);
  },
  async "revert"() {
    await page.click("#revert");
    await until("stiffness is back", () => value("wall.stiffness") === 1000);
    await eventually(page, () => !document.querySelector(".slider.changed"));
  },
  async "a capture is drawn, and exported with where it is from"() {
    await page.click("[data-scope=capture]");
    await page.click("#capture");
    await eventually(page, () => document.getElementById("scope-words").textContent.includes("500 samples"));
    const [file] = await Promise.all([page.waitForEvent("download"), page.click("#export")]);
    const lines = readFileSync(await file.path(), "utf8").trim().split("\n");
    const comments = lines.filter((line) => line.startsWith("#"));
    const [program, image] = spawnSync(KMAX, ["--version"], { encoding: "utf8" }).stdout.trim().split("\n");
    for (const part of ["# date: 20", `# program: kmax view of ${program}`, image, `# device: can:${bus}`, "# firmware: ", "# wall.stiffness = 1000 N/m"])
      assert.ok(comments.some((line) => line.includes(part)), `${part} is not in ${comments.join("\n")}`);
    exported = await file.path();
    assert.deepEqual([lines[comments.length], lines.length - comments.length], ["time_s,position_m,velocity_m_per_s,force_n,current_a", 501]);
    await page.click("[data-scope=rolling]");
  },
  async "recordings are drawn over each other, and a bad file is named"() {
    await page.click("nav [data-view=recordings]");
    const row = (i) => `${i / 1000},${i},${0.01 - i * 1e-5},${-0.01},0.1,0,0,0.02,0,1.5,0,0\n`;
    const heading = ["time_s,tick", ...[0, 1].map((i) => ["position_m", "velocity_m_per_s", "force_n", "current_a", "flags"].map((name) => `axis${i}_${name}`))].join(",");
    const record = { name: "record.csv", mimeType: "text/csv", buffer: Buffer.from(`${heading}\n${Array.from({ length: 2000 }, (_, i) => row(i)).join("")}1.5,2`) };
    const bad = { name: "bad.csv", mimeType: "text/csv", buffer: Buffer.from("time_s,volume\n0,1\n") };
    const wrong = { name: "wrong.csv", mimeType: "text/csv", buffer: Buffer.from("time_s,position_m,force_n\n0,1,2\n1,x,2\n2,1,2\n") };
    await page.setInputFiles("#recording-files", [record, { name: "export.csv", mimeType: "text/csv", buffer: readFileSync(exported) }, bad, wrong]);
    await eventually(page, () => document.querySelectorAll("#legend li").length === 2);
    await page.click("#take");
    await eventually(page, () => document.querySelectorAll("#legend li").length === 3);
    const legend = await page.locator("#legend").textContent();
    assert.match(legend, /record\.csv2000 rows, 2 s, 0\.1 to 0\.1 N; it does not say where its wall is/);
    assert.match(legend, /export\.csv500 rows/);
    await page.setInputFiles("#recording-files", [bad, wrong]);
    await eventually(page, () => document.getElementById("recordings-said").textContent.includes("wrong.csv"));
    const said = await page.locator("#recordings-said").textContent();
    assert.match(said, /bad\.csv: there is no column position_m/);
    assert.match(said, /wrong\.csv, line 3: "x" is no number/);
    // Each in its own colour or dashes, and drawn.
    const inked = () => page.evaluate(() => ["over-distance", "over-time"].map((id) => {
      const canvas = document.getElementById(id);
      return canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data.filter((value, i) => i % 4 === 3 && value > 0).length;
    }));
    const withThree = await inked();
    for (let i = 0; i < 3; ++i) await page.click("#legend button");
    await eventually(page, () => !document.querySelector("#legend li"));
    assert.ok(withThree.every((count) => count > 1000) && (await inked()).every((count) => count === 0), `${withThree}, then ${await inked()}`);
    await page.click("nav [data-view=live]");
  },
  async "a self-test is started by holding its button, and judged in words"() {
    await outside();
    await page.click("nav [data-view=procedures]");
    await hold("self_test");
    await page.waitForSelector("#prompt:not([hidden])");
    assert.ok(await page.locator("#start-contact").isDisabled());
    await page.waitForSelector("#prompt", { state: "hidden" });
    // The simulated person may move the handle meanwhile, which is found.
    assert.match(await page.locator("#result").textContent(), /(✓ Self-test passed|✗ Self-test did not pass).*✓ link.*50 exchanges/);
    assert.equal(await page.locator("#result .finding").count(), 9);
    await until("the axis is not armed", () => !armed());
  },
  async "contact: its prompts are huge, Enter answers; the other page sees it and cannot answer"() {
    await hold("contact");
    await page.waitForSelector("#answer:not([hidden])");
    const size = await page.evaluate(() => Number.parseFloat(getComputedStyle(document.getElementById("prompt-words")).fontSize));
    assert.ok(size >= 70, `${size} px`);
    const other = await open(browser, served.address.url);
    await eventually(other, () => document.getElementById("prompt-words").textContent.includes("press it against the wall"));
    assert.ok(await other.locator("#answer").isHidden());
    await other.close();
    const prompt = page.heard.procedure.prompt;
    await page.keyboard.press("Enter");
    await page.waitForSelector("#state[data-state=armed]");
    await eventually(page, () => document.getElementById("prompt-words").textContent.includes("holding"));
    await until("the next prompt", () => page.heard.procedure.prompt > prompt);
    await page.waitForSelector("#answer:not([hidden])");
  },
  async "a procedure is cancelled, and one under way is stopped by the space bar"() {
    await page.click("#cancel");
    await eventually(page, () => document.getElementById("result").textContent.includes("was cancelled"));
    await until("the axis is not armed", () => !armed());
    await hold("contact");
    await page.waitForSelector("#answer:not([hidden])");
    await page.click("#answer");
    await page.waitForSelector("#state[data-state=armed]");
    await page.keyboard.press("Space");
    await eventually(page, () => document.getElementById("result").textContent.includes("was stopped"));
    await until("the axis is not armed", () => !armed());
  },
  async "a reload in the middle of a procedure ends it"() {
    await outside();
    await hold("contact");
    await page.waitForSelector("#answer:not([hidden])");
    await page.keyboard.press("Enter");
    await page.waitForSelector("#state[data-state=armed]");
    await page.reload();
    await until("it is over", () => page.heard.procedure.phase === "stopped" && !armed());
    await eventually(page, () => document.getElementById("result").textContent.includes("was stopped"));
  },
  async "two pages: the other one sees and stops"() {
    const other = await open(browser, served.address.url);
    await outside();
    await arm(page);
    await stateIs("armed", other);
    await eventually(other, () => document.getElementById("state-detail").textContent.includes("another page"));
    await other.click("#stop");
    await stateIs("stopped");
    await other.close();
    await outside();
    assert.equal(armed(), false);
  },
  async "a reload while armed takes the force"() {
    await arm(page);
    await page.reload();
    // The page itself stops as it is hidden; if it cannot any more, kmax view does.
    await eventually(page, () => /Stopped: (STOP|the page that had armed)/.test(document.getElementById("banner").textContent));
    await until("the axis is not armed", () => !armed());
  },
  async "another page of the same browser can do nothing, not even with the token"() {
    const server = createServer((_, response) => response.end("<!doctype html><title>other</title>"));
    await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
    const context = await browser.newContext();
    const other = await context.newPage();
    await other.goto(`http://127.0.0.1:${server.address().port}/`);
    const heard = await other.evaluate(async ({ stream, token, url }) => {
      const socket = new WebSocket(stream, ["kmax.v1", `token.${token}`]);
      const opened = await new Promise((resolve) => { socket.onopen = () => resolve(true); socket.onerror = () => resolve(false); });
      const read = await fetch(url).then(() => true, () => false);
      const frame = document.createElement("iframe");
      frame.src = url;
      document.body.append(frame);
      await new Promise((resolve) => { frame.onload = resolve; });
      let framed = true;
      try { framed = Boolean(frame.contentDocument?.getElementById("stop")); } catch { framed = false; }
      return { opened, read, framed };
    }, served.address);
    assert.deepEqual(heard, { opened: false, read: false, framed: false });
    await context.close();
    server.close();
  },
  async "without uPlot the values stand there as text"() {
    const context = await browser.newContext();
    const plain = await context.newPage();
    await plain.route("**/uplot.*", (route) => route.abort());
    await plain.goto(served.address.url);
    await eventually(plain, () => document.getElementById("plots").textContent.includes("velocity"));
    await context.close();
  },
  async "a link that is lost is said, and made anew"() {
    await running.end("SIGKILL");
    await stateIs("lost");
    assert.equal(await page.locator("#state-words").textContent(), "Link lost");
    rmSync(bus, { force: true });
    running = await patientDevice();
    await stateIs("disarmed");
    await eventually(page, () => document.getElementById("scope-words").textContent.includes("rows a second"));
  },
  async "kmax view that ends disarms, and the page finds the next one"() {
    await outside();
    await arm(page);
    await served.end("SIGINT");
    await eventually(page, () => document.getElementById("state-words").textContent.includes("cannot be reached"));
    assert.equal(kmax(bus, "state", "--axis", "0", "--json").axes[0].armed, false);
  },
};

let failed = 0;
const chosen = Object.entries(steps).slice(0, extent === "all" ? undefined : 7);
for (const [name, step] of chosen) {
  try {
    await step();
    console.log(`ok ${name}`);
  } catch (error) {
    ++failed;
    const said = await page.evaluate(() => document.getElementById("said").textContent).catch((why) => why.message);
    console.log(`FAILED ${name}: ${error.stack}\nstate: ${JSON.stringify(page.heard.state)}\npage: ${said}\nview: ${served.said}\ndevice: ${running.said}`);
    await page.screenshot({ path: join(tmpdir(), "kmax_view_failed.png") });
    break;  // the next step begins where this one should have ended
  }
}
await browser.close();
await served.end();
await running.end();
rmSync(folder, { recursive: true });
console.log(`${chosen.length} steps, ${failed} FAILED`);
process.exit(failed ? 1 : 0);
