// A headless Chromium by way of the npm package `playwright-core`, which scripts/install_node_packages puts into
// build/view_browser. The browser is Debian's; another one by CHROMIUM in the environment.
import { createRequire } from "node:module";

const require = createRequire(new URL("../../../build/view_browser/", import.meta.url));
const { chromium } = require("playwright-core");

export async function launch() {
  return chromium.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    // In a container root has no sandbox, and /dev/shm is small.
    args: ["--no-sandbox", "--disable-dev-shm-usage", "--hide-scrollbars"],
  });
}

/**
 * The page at `url`, once it has heard of its device; `page.heard` has the newest message of each type that came to it. What
 * goes wrong in it is said on standard error.
 */
export async function open(browser, url, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 720 }, ...options });
  const page = await context.newPage();
  page.on("pageerror", (error) => console.error(`page: ${error.message}`));
  page.on("console", (message) => message.type() === "error" && console.error(`page: ${message.text()}`));
  page.heard = {};
  page.on("websocket", (socket) => socket.on("framereceived", ({ payload }) => {
    const message = JSON.parse(payload);
    page.heard[message.type] = message;
  }));
  await page.goto(url);
  await page.waitForSelector("body[data-ready=yes]");
  return page;
}

/** Presses and holds until the axis is armed, or says why not. */
export async function arm(page) {
  const box = await page.locator("#arm").boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  await page.waitForSelector("#state[data-state=armed]");
  await page.mouse.up();
}
