// SPDX-License-Identifier: Apache-2.0
#include "report/html_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "cli/run_record.h"
#include "sdmt/io/checked_value.h"

namespace sdmt::tools {

namespace {

constexpr std::string_view kStyle = R"(
:root { color-scheme: light; --ink: #1f2937; --muted: #6b7280; --rule: #e5e7eb; --paper: #ffffff; --tint: #f8fafc; }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink); line-height: 1.55; font-size: 15px;
  font-family: -apple-system, BlinkMacSystemFont, "Segoe UI", Inter, Roboto, "Helvetica Neue", Arial, sans-serif; }
main { max-width: 1000px; margin: 0 auto; padding: 48px 32px 72px; }
header { border-bottom: 2px solid var(--ink); padding-bottom: 16px; margin-bottom: 28px; }
h1 { font-size: 30px; line-height: 1.2; letter-spacing: -0.02em; margin: 0 0 6px; }
header p { margin: 0; color: var(--muted); overflow-wrap: anywhere; }
h2 { font-size: 19px; letter-spacing: -0.01em; margin: 44px 0 12px; }
p { max-width: 72ch; margin: 0 0 14px; }
.numbers { display: grid; grid-template-columns: repeat(auto-fit, minmax(138px, 1fr)); gap: 12px; margin: 0 0 8px; }
.number { background: var(--tint); border: 1px solid var(--rule); border-radius: 8px; padding: 14px 16px; }
.number b { display: block; font-size: 27px; line-height: 1.15; letter-spacing: -0.02em; font-variant-numeric: tabular-nums; }
.number span { display: block; font-weight: 600; font-size: 13px; margin-top: 4px; }
.number small { display: block; color: var(--muted); font-size: 12px; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; font-size: 14px; }
th { font-size: 12.5px; font-weight: 600; color: var(--muted); border-bottom: 1.5px solid var(--ink); vertical-align: bottom; }
th, td { padding: 7px 10px; text-align: right; white-space: nowrap; }
th:first-child, td:first-child { text-align: left; padding-left: 0; }
th:last-child, td:last-child { padding-right: 0; }
td { border-bottom: 1px solid var(--rule); }
tr.strong td { font-weight: 650; }
figure { margin: 0 0 18px; }
figure svg, figure img { display: block; max-width: 100%; height: auto; }
figure .wide svg { max-width: none; width: 100%; min-width: 700px; }
.plots { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 420px), 1fr)); gap: 8px; }
.plots svg { width: 100%; max-width: 640px; }
figcaption { color: var(--muted); font-size: 13px; max-width: 90ch; margin-top: 6px; }
.gallery { display: grid; grid-template-columns: repeat(auto-fill, minmax(138px, 1fr)); gap: 12px; }
.card { border: 1px solid var(--rule); border-radius: 8px; padding: 10px; break-inside: avoid; }
.card div { display: flex; gap: 6px; margin-bottom: 8px; }
.card img { width: calc(50% - 3px); aspect-ratio: 1 / 2; object-fit: fill; border-radius: 4px; background: var(--tint); }
.card b { display: block; font-size: 13px; font-variant-numeric: tabular-nums; }
.card small { display: block; color: var(--muted); font-size: 11px; overflow-wrap: anywhere; line-height: 1.35; white-space: pre-line; }
footer { margin-top: 56px; padding-top: 12px; border-top: 1px solid var(--rule); color: var(--muted); font-size: 12.5px; }
footer code { display: block; margin-top: 4px; overflow-wrap: anywhere; white-space: pre-wrap; }
@media (max-width: 600px) { main { padding: 24px 16px 48px; } h1 { font-size: 25px; } }
@media print { main { max-width: none; padding: 0; } h2 { break-after: avoid; } }
)";

// Drawings carry the colours of light paper; these stand for them on dark paper.
constexpr std::array<std::array<std::string_view, 2>, 15> kOnDark = {{{"#ffffff", "#111827"},
                                                                      {"#1f2937", "#e5e7eb"},
                                                                      {"#374151", "#d1d5db"},
                                                                      {"#6b7280", "#9ca3af"},
                                                                      {"#e5e7eb", "#374151"},
                                                                      {"#f1f5f9", "#1f2937"},
                                                                      {"#1d4ed8", "#7aa2ff"},
                                                                      {"#c2410c", "#fb923c"},
                                                                      {"#0f766e", "#2dd4bf"},
                                                                      {"#a16207", "#facc15"},
                                                                      {"#7e22ce", "#c084fc"},
                                                                      {"#be185d", "#f472b6"},
                                                                      {"#475569", "#94a3b8"},
                                                                      {"#4d7c0f", "#a3e635"},
                                                                      {"#dc2626", "#f87171"}}};

std::string dark_style() {
  std::string style =
      "@media screen and (prefers-color-scheme: dark) {\n"
      ":root { color-scheme: dark; --ink: #e5e7eb; --muted: #9ca3af; --rule: #374151; "
      "--paper: #111827; --tint: #1f2937; }\n";
  for (const auto& [light, dark] : kOnDark) {
    style +=
        fmt::format("svg [fill=\"{0}\"] {{ fill: {1}; }} svg [stroke=\"{0}\"] {{ stroke: {1}; }}\n",
                    light, dark);
  }
  return style + "}\n";
}

std::string row(const std::vector<std::string>& cells, std::string_view tag,
                std::string_view attributes = {}) {
  std::string result = fmt::format("<tr{}>", attributes);
  for (const std::string& cell : cells) {
    result += fmt::format("<{0}>{1}</{0}>", tag, escape_markup(cell));
  }
  return result + "</tr>\n";
}

std::string figure(std::string_view content, std::string_view caption) {
  const std::string below =
      caption.empty() ? "" : fmt::format("<figcaption>{}</figcaption>", escape_markup(caption));
  return fmt::format("<figure>\n{}{}</figure>\n", content, below);
}

}  // namespace

HtmlReport::HtmlReport(std::string title, std::string subtitle)
    : title_(std::move(title)), subtitle_(std::move(subtitle)) {}

void HtmlReport::add_heading(std::string_view text) {
  body_ += fmt::format("<h2>{}</h2>\n", escape_markup(text));
}

void HtmlReport::add_paragraph(std::string_view text) {
  body_ += fmt::format("<p>{}</p>\n", escape_markup(text));
}

void HtmlReport::add_numbers(std::span<const HtmlNumber> numbers) {
  body_ += "<div class=\"numbers\">\n";
  for (const HtmlNumber& number : numbers) {
    body_ += fmt::format("<div class=\"number\"><b>{}</b><span>{}</span><small>{}</small></div>\n",
                         escape_markup(number.value), escape_markup(number.label),
                         escape_markup(number.note));
  }
  body_ += "</div>\n";
}

void HtmlReport::add_table(const HtmlTable& table) {
  std::string text =
      "<div class=\"wide\"><table>\n<thead>" + row(table.header, "th") + "</thead>\n<tbody>\n";
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const bool strong =
        std::find(table.strong_rows.begin(), table.strong_rows.end(), i) != table.strong_rows.end();
    text += row(table.rows[i], "td", strong ? " class=\"strong\"" : "");
  }
  // A caption inside would be as wide as the table, and scrolled out of sight with it.
  body_ += figure(text + "</tbody></table></div>\n", table.caption);
}

void HtmlReport::add_plots(std::span<const SvgPlot> plots, std::string_view caption) {
  std::string text = "<div class=\"plots\">\n";
  for (const SvgPlot& plot : plots) text += plot.str();
  body_ += figure(text + "</div>\n", caption);
}

void HtmlReport::add_svg(std::string_view svg, std::string_view caption) {
  body_ += figure(fmt::format("<div class=\"wide\">{}</div>\n", svg), caption);
}

void HtmlReport::add_image(std::string_view uri, std::string_view caption) {
  body_ += figure(
      fmt::format("<img src=\"{}\" alt=\"{}\">\n", escape_markup(uri), escape_markup(caption)),
      caption);
}

void HtmlReport::add_gallery(std::span<const HtmlCard> cards) {
  body_ += "<div class=\"gallery\">\n";
  for (const HtmlCard& card : cards) {
    body_ += "<div class=\"card\"><div>";
    for (const std::string& uri : card.images) {
      body_ += fmt::format("<img src=\"{}\" alt=\"\">", escape_markup(uri));
    }
    body_ += fmt::format("</div><b>{}</b><small>{}</small></div>\n", escape_markup(card.caption),
                         escape_markup(card.note));
  }
  body_ += "</div>\n";
}

std::string HtmlReport::str() const {
  constexpr std::size_t kLongest = 20000;
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{0}</title>\n<style>{1}{5}</style>\n</head>\n<body>\n<main>\n<header><h1>{0}</h1>\n"
      "<p>{2}</p></header>\n{3}<footer>sdmt {4}, "
      "{6}<code>{7}</code></footer>\n</main>\n</body>\n</html>\n",
      escape_markup(title_), kStyle, escape_markup(subtitle_), body_, SDMT_VERSION, dark_style(),
      date_of_run(), escape_markup(io::printable(command_line(), kLongest)));
}

std::string data_uri(std::string_view media_type, std::span<const std::uint8_t> bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string uri = fmt::format("data:{};base64,", media_type);
  uri.reserve(uri.size() + (bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (k < left ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) {
      uri += k <= left ? kDigits[group >> (18 - 6 * k) & 63U] : '=';
    }
  }
  return uri;
}

}  // namespace sdmt::tools
