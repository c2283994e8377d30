#!/usr/bin/env node
// Pictures of the live page while a simulated person presses against a wall, in every size, light and dark; and
// the frames of a moving one, of which `img2webp -loop 0 -d 120 -lossy -q 70 FOLDER/frames/*.png -o FOLDER/view.webp` (Debian
// package webp) makes one file.
// usage: pictures.mjs FOLDER      with KMAX in the environment, or build/native/kmax
import { mkdirSync, rmSync } from "node:fs";
import { join } from "node:path";
import { arm, launch, open } from "./browser.mjs";
import { device, view } from "./kmax_processes.mjs";

const FIELDS = [0, 1, 2];  // N, of the recordings
const SIZES = { desk: [1280, 720], tablet: [1024, 768], portrait: [768, 1024], telephone: [412, 915] };
const FRAMES = 70;

const scene = new URL("long_touch.toml", import.meta.url).pathname;
const folder = process.argv[2];
mkdirSync(join(folder, "frames"), { recursive: true });
const bus = join(folder, "bus");
const running = await device([process.env.KMAX ?? "build/native/kmax", "serve", "--can", "BUS", "--scene", scene], bus);
const served = await view(bus);
const browser = await launch();
const page = await open(browser, served.address.url);

const picture = (name, options = {}) => page.screenshot({ path: join(folder, `${name}.png`), ...options });
const drag = (place, shown) => page.evaluate(([i, value]) => {
  const slider = document.querySelectorAll(".slider input[type=range]")[i];
  slider.value = value;
  slider.dispatchEvent(new Event("input"));
}, [place, shown]);

await picture("disarmed");
await arm(page);
await page.waitForTimeout(1500);
for (let frame = 0; frame < FRAMES; ++frame) {
  // The wall oscillates, and holds still once the field is strong enough.
  if (frame > FRAMES / 3) await drag(2, Math.min(2, (frame / FRAMES - 1 / 3) * 4));
  await page.screenshot({ path: join(folder, "frames", `${String(frame).padStart(3, "0")}.png`) });
}
await drag(2, 0.5);
for (const scheme of ["light", "dark"]) {
  await page.emulateMedia({ colorScheme: scheme });
  for (const [name, [width, height]] of Object.entries(SIZES)) {
    await page.setViewportSize({ width, height });
    await page.waitForTimeout(400);
    await picture(`${name}_${scheme}`, { fullPage: true });
  }
  await page.setViewportSize({ width: 1280, height: 720 });
  await page.click("[data-scope=capture]");
  await page.click("#capture");
  await page.waitForFunction(() => document.getElementById("scope-words").textContent.includes("samples"));
  await picture(`capture_${scheme}`);
  await page.click("[data-scope=spectrum]");
  await page.waitForTimeout(600);
  await picture(`spectrum_${scheme}`);
  await page.click("[data-scope=rolling]");
}
const inEverySize = async (name) => {
  for (const scheme of ["light", "dark"]) {
    await page.emulateMedia({ colorScheme: scheme });
    for (const size of ["desk", "tablet"]) {
      await page.setViewportSize({ width: SIZES[size][0], height: SIZES[size][1] });
      await page.waitForTimeout(400);
      await picture(`${name}_${size}_${scheme}`);
    }
  }
};
for (const field of FIELDS) {
  await drag(2, field);
  await page.waitForTimeout(4000);
  await page.click("nav [data-view=recordings]");
  await page.click("#take");
  await page.click("nav [data-view=live]");
}
await page.click("nav [data-view=recordings]");
await inEverySize("recordings");
await page.keyboard.press("Space");
await page.waitForSelector("#state[data-state=stopped]");
await page.click("nav [data-view=live]");
await picture("stopped");
await page.click("nav [data-view=procedures]");
await inEverySize("procedures");
const start = async (name) => {
  await page.locator(`#start-${name}`).scrollIntoViewIfNeeded();
  const box = await page.locator(`#start-${name}`).boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  await page.waitForSelector("#prompt:not([hidden])");
  await page.mouse.up();
};
await start("self_test");
await page.waitForSelector("#prompt", { state: "hidden" });
await inEverySize("result");
await start("contact");
await page.waitForSelector("#answer:not([hidden])");
await inEverySize("prompt");
await page.keyboard.press("Enter");
await page.waitForSelector("#answer", { state: "hidden" });
await page.waitForTimeout(400);
await picture("touch");
await page.click("nav [data-view=live]");
await picture("touch_live");
await page.keyboard.press("Space");
await running.end("SIGKILL");
await page.waitForSelector("#state[data-state=lost]");
await picture("lost");
await browser.close();
await served.end();
rmSync(bus, { force: true });
