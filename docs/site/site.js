// SPDX-License-Identifier: GPL-2.0-or-later
// Formulas: KaTeX draws what pymdownx.arithmatex has marked.
document.addEventListener("DOMContentLoaded", () => {
    for (const element of document.querySelectorAll(".arithmatex")) {
        const text = element.textContent.trim();
        katex.render(text.slice(2, -2), element, { displayMode: text.startsWith("\\["), throwOnError: false });
    }
});
