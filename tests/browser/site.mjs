// SPDX-License-Identifier: GPL-2.0-or-later
// What a reader of the documentation site does, in headless Chromium: every page from a server of its own, and from the
// disk. tests/browser/run calls it with the folder of the site; LOBATTO_PICTURES names a folder for pictures to look at.
import { createServer } from "node:http";
import { existsSync, readFileSync, readdirSync, statSync } from "node:fs";
import { extname, join, normalize, relative } from "node:path";
import { chromium } from "playwright-core";

const site = process.argv[2], pictures = process.env.LOBATTO_PICTURES;
let passed = 0, failed = 0;
function check(claim, holds, shown = "") {
    if (holds) ++passed; else { ++failed; console.log(`FAILED: ${claim} ${shown}`); }
}

const kinds = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml",
                ".json": "application/json", ".png": "image/png", ".gif": "image/gif", ".woff2": "font/woff2" };
const server = createServer((request, response) => {
    const path = join(site, normalize(decodeURIComponent(new URL(request.url, "http://localhost").pathname)));
    const file = path.endsWith("/") ? path + "index.html" : path;
    if (!existsSync(file)) { response.writeHead(404).end(); return; }
    response.writeHead(200, { "content-type": kinds[extname(file)] ?? "application/octet-stream" }).end(readFileSync(file));
});
await new Promise(resolve => server.listen(0, "127.0.0.1", resolve));
const home = `http://127.0.0.1:${server.address().port}`;

const browser = await chromium.launch({ executablePath: "/usr/bin/chromium",
    args: ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
           "--disable-component-update", "--disable-sync"] });

// The page, and everything that it complained of or asked others for.
async function opened(address, options = {}) {
    const page = await browser.newPage({ viewport: { width: 1280, height: 800 }, ...options });
    const complaints = [];
    page.on("console", message => { if (["error", "warning"].includes(message.type())) complaints.push(message.text()); });
    page.on("pageerror", error => complaints.push(String(error)));
    page.on("response", response => { if (response.status() >= 400) complaints.push(`${response.status()} ${response.url()}`); });
    page.on("request", request => {
        if (!request.url().startsWith(home) && !/^(file|data|blob|about):/.test(request.url())) complaints.push(request.url());
    });
    await page.goto(address, { waitUntil: "load" });
    return { page, complaints };
}

const files = readdirSync(site, { recursive: true }).filter(name => name.endsWith(".html") && !name.startsWith("moving/"));
const anchors = new Map(), links = [];
for (const name of files.filter(name => name !== "404.html")) {
    const { page, complaints } = await opened(`${home}/${name}`);
    check(`${name}: nothing to complain of, and nothing fetched from others`, complaints.length === 0, complaints.join("; "));
    const seen = await page.evaluate(() => ({
        anchors: [...document.querySelectorAll("[id]")].map(element => element.id),
        links: [...document.querySelectorAll(".md-content a[href]")].map(link => link.href),
        formulas: document.querySelectorAll(".arithmatex").length,
        drawn: document.querySelectorAll(".arithmatex .katex").length,
        wrong: [...document.querySelectorAll(".katex-error")].map(element => element.title),
        stray: /\$\$|\\tag|\\mathsf/.test([...document.querySelectorAll(".md-content p, .md-content li")]
            .filter(element => !element.querySelector(".katex, code")).map(element => element.textContent).join(" ")),
        pictures: [...document.images].filter(image => image.loading !== "lazy" && !(image.complete && image.naturalWidth)).map(image => image.src),
    }));
    check(`${name}: every formula is drawn`, seen.drawn === seen.formulas && seen.wrong.length === 0 && !seen.stray, seen.wrong.join("; "));
    check(`${name}: every picture is there`, seen.pictures.length === 0, seen.pictures.join("; "));
    anchors.set(name, new Set(seen.anchors));
    for (const link of seen.links) links.push([name, link]);
    await page.close();
}
for (const [from, link] of links) {
    if (!link.startsWith(home)) continue;
    const there = new URL(link), name = relative("/", decodeURIComponent(there.pathname)) || "index.html";
    const is_there = existsSync(join(site, name)) && statSync(join(site, name)).isFile();
    if (!is_there) check(`${from}: its link leads somewhere`, false, link);
    if (is_there && there.hash && anchors.has(name))
        check(`${from}: the place in its link exists`, anchors.get(name).has(decodeURIComponent(there.hash.slice(1))), link);
}
const derivation = await opened(`${home}/derivation.html`);
check("the derivation has a hundred formulas and more", await derivation.page.locator(".katex").count() > 100);
await derivation.page.close();

const { page } = await opened(`${home}/index.html`);
const scheme = () => page.evaluate(() => document.body.getAttribute("data-md-color-scheme"));
const before = await scheme();
await page.locator(".md-header__option label:visible").first().click();
check("a click makes it dark, or light", await scheme() !== before);
await page.locator(".md-search__input").click();
// Its index is read in another thread, which takes a while on a busy machine.
await page.waitForFunction(() => /Type/.test(document.querySelector(".md-search-result__meta").textContent), null, { timeout: 60000 }).catch(() => {});
await page.locator(".md-search__input").pressSequentially("symplectic", { delay: 30 });
await page.waitForSelector(".md-search-result__item", { timeout: 30000 }).catch(() => {});
check("the search finds something", await page.locator(".md-search-result__item").count() > 3);
await page.close();

const moving = await opened(`${home}/moving.html`);
const frame = moving.page.frames().find(one => one.url().includes("moving/double_pendulum"));
check("the scene on the page moves", await frame.waitForFunction(() => window.lobatto && window.lobatto.state.frames > 3).then(() => true));
const is_dark = () => frame.evaluate(() => document.documentElement.classList.contains("dark"));
const was_dark = await is_dark();
await moving.page.locator(".md-header__option label:visible").first().click();
await moving.page.waitForTimeout(300);
check("and is as dark or light as the page", await is_dark() !== was_dark);
await moving.page.close();

for (const name of ["index.html", "derivation.html", "moving.html", "scenes/kepler.html"]) {
    const phone = await opened(`${home}/${name}`, { viewport: { width: 390, height: 844 }, hasTouch: true });
    check(`${name}: a telephone needs no sideways scrolling`,
          await phone.page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth));
    await phone.page.close();
    const disk = await opened(`file://${join(site, name)}`);
    const unasked = disk.complaints;
    check(`${name}: opens from the disk`, unasked.length === 0, unasked.join("; "));
    await disk.page.close();
}

if (pictures)
    for (const [where, viewport] of [["desktop", { width: 1280, height: 900 }], ["phone", { width: 390, height: 844 }]])
        for (const colorScheme of ["light", "dark"])
            for (const name of ["index", "derivation", "moving", "scenes/kepler", "api/cpp", "coming_from", "limits", "commands", "benchmarks"]) {
                const one = await opened(`${home}/${name}.html`, { viewport, colorScheme });
                await one.page.waitForTimeout(400);
                await one.page.screenshot({ path: join(pictures, `${name.replace("/", "_")}-${where}-${colorScheme}.png`) });
                await one.page.close();
            }
await browser.close();
server.close();
console.log(`${passed} passed, ${failed} failed`);
process.exit(failed > 0 ? 1 : 0);
