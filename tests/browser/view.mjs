// SPDX-License-Identifier: GPL-2.0-or-later
// What a reader of a page does, in headless Chromium. tests/browser/run calls it in the folder of the pages.
import { readdirSync, statSync } from "node:fs";
import { chromium } from "playwright-core";

let passed = 0, failed = 0;
function check(claim, holds, shown = "") {
    if (holds) ++passed; else { ++failed; console.log(`FAILED: ${claim} ${shown}`); }
}

const browser = await chromium.launch({ executablePath: "/usr/bin/chromium",
    args: ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
           "--disable-component-update", "--disable-sync"] });

// The page, and everything that it complained of or asked the net for.
async function opened(name, options = {}) {
    const page = await browser.newPage({ viewport: { width: 1100, height: 700 }, ...options });
    const complaints = [];
    page.on("console", message => { if (message.type() !== "log") complaints.push(message.text()); });
    page.on("pageerror", error => complaints.push(String(error)));
    page.on("request", request => { if (!request.url().startsWith("file:")) complaints.push(request.url()); });
    await page.goto(`file://${process.cwd()}/${name}.html`);
    await page.waitForFunction(() => window.lobatto && window.lobatto.state.frames > 3);
    return { page, complaints };
}
const time = page => page.evaluate(() => window.lobatto.state.time);
// Whether a canvas shows more than its empty pane.
const is_drawn = (page, selector) => page.evaluate(selector => [...document.querySelectorAll(selector)].every(canvas => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let drawn = 0;
    for (let i = 3; i < data.length; i += 4) if (data[i] > 0) ++drawn;
    return drawn > 40;
}), selector);

const names = readdirSync(".").filter(name => name.endsWith(".html")).map(name => name.slice(0, -5));
for (const name of names) {
    const { page, complaints } = await opened(name);
    check(`${name}: nothing to complain of, and nothing fetched`, complaints.length === 0, complaints.join("; "));
    check(`${name}: the motion and the curves are drawn`, await is_drawn(page, "canvas"));
    check(`${name}: at most 3 MB`, statSync(`${name}.html`).size < 3e6);
    await page.close();
}

const { page } = await opened("double_pendulum");
const before = await time(page);
await page.waitForTimeout(300);
check("it plays", await time(page) > before);
await page.keyboard.press(" ");
const paused = await time(page);
await page.waitForTimeout(150);
check("space pauses", await time(page) === paused);
await page.keyboard.press("ArrowRight");
check("an arrow goes on", await time(page) > paused);
await page.keyboard.press("Home");
check("Home goes to the start", await time(page) === 0);
await page.keyboard.press("End");
check("End goes to the end", await time(page) === 50);
const rate = await page.evaluate(() => window.lobatto.state.rate);
await page.keyboard.press("+");
check("+ is faster", await page.evaluate(() => window.lobatto.state.rate) > rate);
await page.keyboard.press("-");
check("- is slower again", Math.abs(await page.evaluate(() => window.lobatto.state.rate) / rate - 1) < 1e-9);
const is_dark = () => page.evaluate(() => document.documentElement.classList.contains("dark"));
const dark = await is_dark();
await page.keyboard.press("d");
check("d changes the theme", await is_dark() !== dark);
await page.click("#trails");
await page.waitForTimeout(100);  // the next frame shows it
check("the trails go", await page.getAttribute("#trails", "aria-pressed") === "false");
await page.locator("#charts canvas").first().click({ position: { x: 200, y: 40 } });
check("a click on a curve goes there", await time(page) > 5 && await time(page) < 45);
await page.close();

const phone = await opened("rigid_top", { viewport: { width: 390, height: 844 }, hasTouch: true, colorScheme: "dark" });
check("a telephone needs no sideways scrolling",
      await phone.page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth));
check("dark where the reader prefers it", await phone.page.evaluate(() => document.documentElement.classList.contains("dark")));
const box = await phone.page.locator("#scenes canvas").boundingBox();
const pixels = () => phone.page.locator("#scenes canvas").screenshot();
await phone.page.keyboard.press(" ");
const seen = await pixels();
await phone.page.mouse.move(box.x + 100, box.y + 100);
await phone.page.mouse.down();
await phone.page.mouse.move(box.x + 180, box.y + 130);
await phone.page.mouse.up();
await phone.page.waitForTimeout(100);
check("dragging turns what is in space", !seen.equals(await pixels()));
await phone.page.close();

// Frames a second with ten bodies on this machine, without a graphics card, and what the page itself takes of a frame:
// told, not checked.
const fast = await opened("ten_bodies");
const session = await fast.page.context().newCDPSession(fast.page);
await session.send("Performance.enable");
const spent = async () => {
    const { metrics } = await session.send("Performance.getMetrics");
    return { frames: await fast.page.evaluate(() => window.lobatto.state.frames),
             ...Object.fromEntries(metrics.map(({ name, value }) => [name, value])) };
};
const begun = await spent();
await fast.page.waitForTimeout(3000);
const ended = await spent();
const counted = ended.frames - begun.frames;
check("ten bodies move", counted > 3);
console.log(`ten bodies: ${(counted / (ended.Timestamp - begun.Timestamp)).toFixed(0)} frames a second; of 16.7 ms the ` +
            `page takes ${(1000 * (ended.TaskDuration - begun.TaskDuration) / counted).toFixed(1)}`);
await browser.close();
console.log(`${passed} passed, ${failed} failed`);
process.exit(failed > 0 ? 1 : 0);
