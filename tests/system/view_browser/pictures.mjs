#!/usr/bin/env node
// Pictures of the live page while a simulated person presses against the wall.
// usage: pictures.mjs URL FOLDER [moving]      moving: also the frames of a moving picture, FOLDER/frames/*.png
import { mkdirSync } from "node:fs";
import { arm, launch, open } from "./browser.mjs";

const [url, folder, moving] = process.argv.slice(2);
mkdirSync(folder, { recursive: true });
const browser = await launch();
const SIZES = { desk: { width: 1280, height: 720 }, tablet: { width: 1024, height: 768 }, portrait: { width: 768, height: 1024 }, telephone: { width: 412, height: 915 } };

const set = (page, name, value) => page.locator(`#field-${name.replaceAll(".", "-")}`).fill(value).then(() => page.keyboard.press("Tab"));

const page = await open(browser, url);
await page.selectOption("#law", "magnetic");
await set(page, "wall.stiffness", "2");
await page.locator("summary").click();
await set(page, "wall.stiffness_ceiling", "10");
await page.locator("summary").click();
await page.screenshot({ path: `${folder}/disarmed.png` });
await arm(page);
await page.waitForTimeout(2500);
for (const scheme of ["light", "dark"]) {
  await page.emulateMedia({ colorScheme: scheme });
  for (const [name, size] of Object.entries(SIZES)) {
    await page.setViewportSize(size);
    await page.waitForTimeout(500);
    await page.screenshot({ path: `${folder}/${name}_${scheme}.png`, fullPage: true });
  }
  await page.setViewportSize(SIZES.desk);
  await page.click("[data-scope=capture]");
  await page.click("#capture");
  await page.waitForFunction(() => document.getElementById("scope-words").textContent.includes("samples"));
  await page.waitForTimeout(300);
  await page.screenshot({ path: `${folder}/capture_${scheme}.png` });
  await page.click("[data-scope=spectrum]");
  await page.waitForTimeout(600);
  await page.screenshot({ path: `${folder}/spectrum_${scheme}.png` });
  await page.click("[data-scope=rolling]");
}
if (moving) {
  mkdirSync(`${folder}/frames`, { recursive: true });
  await page.emulateMedia({ colorScheme: "light" });
  await page.click("#revert");
  await set(page, "wall.stiffness_ceiling", "10");
  for (let i = 0; i < 60; ++i) {
    if (i % 2 === 0) await set(page, "wall.stiffness", String((1 + i / 12).toFixed(2)));
    await page.screenshot({ path: `${folder}/frames/${String(i).padStart(3, "0")}.png` });
  }
}
await page.keyboard.press("Space");
await page.waitForSelector("#state[data-state=stopped]");
await page.screenshot({ path: `${folder}/stopped.png` });
await browser.close();
