// SPDX-License-Identifier: MIT
// Opens a page in headless Chromium, where it is installed, and reports what is found inside the
// page.
#pragma once

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "engine/core/files.h"

namespace darb::test {

inline std::string chromium() {
    for (const char* name : {"chromium", "chromium-browser", "google-chrome"})
        if (std::system(fmt::format("command -v {} > /dev/null 2>&1", name).c_str()) == 0)
            return name;
    return {};
}

struct OpenedPage {
    int plots = 0, drawn = 0;   // SVG elements; those with a visible curve, dot or area
    int pictures = 0;           // elements with a background picture of some size
    int cut = 0, overlaps = 0;  // texts of plots that reach beyond the plot's edge; that overlap
    std::string touching;       // the first text that is cut or overlaps
    std::string console;        // what was written to the console
};

/// A script appended to the page writes what it finds into the title.
inline OpenedPage open_page(const std::string& html, const std::filesystem::path& folder) {
    constexpr const char* kProbe =
        "<script>const all=[...document.querySelectorAll('svg')];"
        "const seen=e=>{const b=e.getBoundingClientRect();return b.width>0||b.height>0};"
        "document.title='PLOTS '+all.length+' '+all.filter(s=>seen(s)&&[...s.querySelectorAll("
        "'path.line,path.area,circle')].some(seen)).length+' '+[...document.querySelectorAll("
        "'.pane')].filter(e=>seen(e)&&getComputedStyle(e).backgroundImage.startsWith('url'))"
        ".length;"
        "let cut=0,over=0,first='';for(const s of all){const f=s.getBoundingClientRect();"
        "const t=[...s.querySelectorAll('text')].map(e=>{const r=e.getBoundingClientRect();"
        "r.said=e.firstChild?.data;return r});"
        "t.forEach((a,i)=>{if(a.left<f.left-1||a.right>f.right+1||a.top<f.top-1||"
        "a.bottom>f.bottom+1){cut++;first||=a.said+' at the edge'}"
        "t.slice(i+1).forEach(b=>{if(Math.min(a.right,b.right)-"
        "Math.max(a.left,b.left)>1&&Math.min(a.bottom,b.bottom)-Math.max(a.top,b.top)>"
        "0.35*a.height){over++;first||=a.said+' on '+b.said}})})}"
        "document.title+=' '+cut+' '+over+' END '+first+' STOP'</script>";
    const auto page = folder / fmt::format("page_{}.html", ::getpid());
    const auto dom = folder / fmt::format("dom_{}.html", ::getpid());
    const auto log = folder / fmt::format("log_{}.txt", ::getpid());
    const auto profile = folder / fmt::format("profile_{}", ::getpid());
    std::string probed = html;
    probed.insert(probed.rfind("</body>"), kProbe);
    write_file_atomic(page, probed);
    OpenedPage opened;
    if (std::system(fmt::format("{} --headless --no-sandbox --disable-gpu --user-data-dir='{}' "
                                "--enable-logging=stderr --dump-dom 'file://{}' > '{}' 2> '{}'",
                                chromium(), profile.string(), page.string(), dom.string(),
                                log.string())
                        .c_str()) != 0)
        opened.console = "chromium failed: " + read_text_file(log);
    const std::string text = read_text_file(dom), said = read_text_file(log);
    const size_t at = text.find("PLOTS ");
    if (at != std::string::npos)
        std::sscanf(text.c_str() + at, "PLOTS %d %d %d %d %d END", &opened.plots, &opened.drawn,
                    &opened.pictures, &opened.cut, &opened.overlaps);
    if (const size_t from = text.find(" END "), to = text.find(" STOP"); to != std::string::npos)
        opened.touching = text.substr(from + 5, to - from - 5);
    if (const size_t line = said.find("CONSOLE"); line != std::string::npos)
        opened.console += said.substr(line, 400);
    for (const auto& file : {page, dom, log}) std::filesystem::remove(file);
    std::filesystem::remove_all(profile);
    return opened;
}

}  // namespace darb::test
