// SPDX-License-Identifier: GPL-2.0-or-later
// Formulas: KaTeX draws what pymdownx.arithmatex has marked.
document.addEventListener("DOMContentLoaded", () => {
    for (const element of document.querySelectorAll(".arithmatex")) {
        const text = element.textContent.trim();
        katex.render(text.slice(2, -2), element, { displayMode: text.startsWith("\\["), throwOnError: false });
    }
});

// Scenes that move are as dark or light as the page around them. From the disk a page may not look into another.
function match(frame) {
    try {
        const dark = document.body.getAttribute("data-md-color-scheme") === "slate";
        if (frame.contentDocument.documentElement.classList.contains("dark") !== dark)
            frame.contentWindow.dispatchEvent(new KeyboardEvent("keydown", { key: "d" }));
    } catch { /* it stays as the reader's system prefers */ }
}
document.addEventListener("DOMContentLoaded", () => {
    const frames = document.querySelectorAll("iframe.moving");
    for (const frame of frames) frame.addEventListener("load", () => match(frame));
    new MutationObserver(() => frames.forEach(match)).observe(document.body, { attributeFilter: ["data-md-color-scheme"] });
});
