// SPDX-License-Identifier: MIT
#include "engine/report/html.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "engine/core/count_text.h"
#include "engine/report/palette.h"

namespace darb {

std::string html_escape(std::string_view text) {
    std::string out;
    for (const char c : text) {
        switch (c) {
            case '&':
                out += "&amp;";
                break;
            case '<':
                out += "&lt;";
                break;
            case '>':
                out += "&gt;";
                break;
            case '"':
                out += "&quot;";
                break;
            case '\'':
                out += "&#39;";
                break;
            default:
                out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
        }
    }
    return out;
}

std::string base64(std::span<const std::byte> bytes) {
    constexpr std::string_view kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    out.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
        std::uint32_t bits = 0;
        for (std::size_t k = 0; k < 3; ++k)
            bits = bits << 8 | (k < count ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0);
        for (std::size_t k = 0; k < 4; ++k)
            out += k <= count ? kDigits[bits >> (18 - 6 * k) & 63] : '=';
    }
    return out;
}

std::string format_number(double v, int decimals) {
    if (!std::isfinite(v)) return "-";
    return with_thousands(fmt::format("{:.{}f}", v, decimals));
}

namespace {

constexpr const char* kStyle = R"css(*{box-sizing:border-box}
body{margin:0 auto;max-width:1080px;padding:2rem 1.25rem 4rem;background:var(--page);color:var(--ink);
font:15px/1.5 system-ui,sans-serif}
h1{font-size:1.5rem;margin:0;overflow-wrap:anywhere}h2{font-size:1.05rem;margin:2.2rem 0 .7rem}
p{margin:.3rem 0}.soft{color:var(--soft)}
.cards{display:flex;flex-wrap:wrap;gap:.7rem;margin-top:1.2rem}
.cards div{background:var(--card);border-radius:8px;padding:.6rem .9rem;min-width:7.5rem;flex:1}
.cards b{display:block;font-size:1.3rem;font-variant-numeric:tabular-nums}
.plots{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,400px),1fr));gap:1rem}
svg{width:100%;max-width:720px;height:auto;background:var(--card);border-radius:8px;break-inside:avoid}
svg.bars{max-width:900px;grid-column:1/-1}
svg text{fill:var(--ink);font:12px system-ui,sans-serif}svg .name{font-weight:600;font-size:13px}
svg .tick,svg .label{fill:var(--soft);font-size:11px}
.grid{stroke:var(--line)}.axis{stroke:var(--soft);fill:none}.line{fill:none;stroke-width:1.8;stroke-linejoin:round}
.area{stroke:var(--card);stroke-width:.6}.band{fill-opacity:.18}.whisker{stroke:var(--ink);stroke-width:1.6;fill:none}
.legend{display:flex;flex-wrap:wrap;gap:.2rem 1rem;margin:.5rem 0;color:var(--soft)}
.legend i{display:inline-block;width:.8em;height:.8em;border-radius:2px;margin-right:.35em;
-webkit-print-color-adjust:exact;print-color-adjust:exact}
tr.mark td{font-weight:600}ul{margin:.4rem 0;padding-left:1.2rem}
.wide{overflow-x:auto}table{border-collapse:collapse;font-variant-numeric:tabular-nums}
th,td{text-align:right;padding:.22rem .9rem .22rem 0;border-bottom:1px solid var(--line);white-space:nowrap}
th{color:var(--soft);font-weight:500}th:first-child,td:first-child,th.left,td.left,td.text{text-align:left}
td.text{white-space:normal;overflow-wrap:anywhere;min-width:11rem}
td.bar{width:14rem;padding-right:0}td.bar i{display:block;height:.7em;border-radius:3px;
-webkit-print-color-adjust:exact;print-color-adjust:exact}
figure{margin:0 0 1.2rem;break-inside:avoid}
.pair{display:grid;grid-template-columns:1fr 1fr;gap:.5rem}
.pane{aspect-ratio:var(--r);background:0 0/300% 100%;border-radius:6px;position:relative;
-webkit-print-color-adjust:exact;print-color-adjust:exact}
.render{position:absolute;inset:0;background-position:50% 0;clip-path:inset(0 calc(100% - var(--x)) 0 0)}
.error{background-position:100% 0}
figcaption{display:flex;justify-content:space-between;color:var(--soft);margin-bottom:.25rem;gap:1rem}
@media print{body{max-width:none;padding:0;font-size:11px}h2{break-after:avoid}.wide{overflow:visible}
th,td{padding-right:.5rem}.plots{grid-template-columns:1fr 1fr}.area,circle,.line,.cards div{-webkit-print-color-adjust:exact;print-color-adjust:exact}}
.parts{display:grid;grid-template-columns:1fr 1fr;gap:.5rem;color:var(--soft);font-size:.85rem}
)css";

// The variables that the style names, without braces.
std::string variables(const Palette& p) {
    std::string css =
        fmt::format("--ink:{};--soft:{};--line:{};--page:{};--card:{}", css_colour(p.ink),
                    css_colour(p.soft), css_colour(p.line), css_colour(p.page), css_colour(p.card));
    for (std::size_t i = 0; i < p.series.size(); ++i)
        css += fmt::format(";--s{}:{}", i, css_colour(p.series[i]));
    return css;
}

std::string style() {
    std::string css =
        fmt::format("\n:root{{{}}}\n@media screen and (prefers-color-scheme:dark){{:root{{{}}}}}\n",
                    variables(palette::kLight), variables(palette::kDark));
    css += kStyle;
    for (std::size_t i = 0; i < palette::kLight.series.size(); ++i)
        css += fmt::format(
            ".line.s{0}{{stroke:var(--s{0})}}circle.s{0},.band.s{0},.area.s{0}{{fill:var(--s{0})}}"
            "i.s{0}{{background:var(--s{0})}}\n",
            i);
    return css;
}

}  // namespace

std::string css_colour(const PaletteColour& c) {
    return fmt::format("#{:02x}{:02x}{:02x}", c.r, c.g, c.b);
}

std::string html_page(const std::string& title, const std::string& subtitle,
                      const std::string& body) {
    std::string html = "<!DOCTYPE html>\n<html lang='en'><head><meta charset='utf-8'>\n";
    html += "<meta name='viewport' content='width=device-width,initial-scale=1'>\n";
    html += "<meta name='color-scheme' content='light dark'>\n";
    html += fmt::format("<title>{}</title>\n<style>{}</style></head><body>\n", html_escape(title),
                        style());
    html += fmt::format("<h1>{}</h1>\n<p class='soft'>{}</p>\n", html_escape(title),
                        html_escape(subtitle));
    return html + body + "</body></html>\n";
}

std::string html_legend(const std::vector<std::string>& names) {
    std::string html;
    for (size_t i = 0; i < names.size(); ++i)
        html += fmt::format("<span><i class='s{}'></i>{}</span>", i, html_escape(names[i]));
    return "<div class='legend'>" + html + "</div>\n";
}

std::string html_card(const std::string& value, const std::string& name) {
    return fmt::format("<div><b>{}</b><span class='soft'>{}</span></div>", html_escape(value),
                       html_escape(name));
}

}  // namespace darb
