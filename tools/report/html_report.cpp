// SPDX-License-Identifier: Apache-2.0
#include "report/html_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "report/svg_plot.h"

namespace sdmt::tools {

namespace {

constexpr std::string_view kStyle = R"(
:root { --ink: #1f2937; --muted: #6b7280; --rule: #e5e7eb; --paper: #ffffff; --tint: #f8fafc; }
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
.wide { overflow-x: auto; margin: 0 0 14px; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; font-size: 14px; }
th { font-size: 12.5px; font-weight: 600; color: var(--muted); border-bottom: 1.5px solid var(--ink); vertical-align: bottom; }
th, td { padding: 7px 10px; text-align: right; white-space: nowrap; }
th:first-child, td:first-child { text-align: left; padding-left: 0; }
th:last-child, td:last-child { padding-right: 0; }
td { border-bottom: 1px solid var(--rule); }
tr.strong td { font-weight: 650; }
caption { caption-side: bottom; text-align: left; color: var(--muted); font-size: 13px; padding-top: 8px; }
figure { margin: 0 0 18px; }
figure svg, figure img { display: block; max-width: 100%; height: auto; }
figcaption { color: var(--muted); font-size: 13px; max-width: 90ch; margin-top: 6px; }
.gallery { display: grid; grid-template-columns: repeat(auto-fill, minmax(138px, 1fr)); gap: 12px; }
.card { border: 1px solid var(--rule); border-radius: 8px; padding: 10px; break-inside: avoid; }
.card div { display: flex; gap: 6px; margin-bottom: 8px; }
.card img { width: calc(50% - 3px); aspect-ratio: 1 / 2; object-fit: fill; border-radius: 4px; background: var(--tint); }
.card b { display: block; font-size: 13px; font-variant-numeric: tabular-nums; }
.card small { display: block; color: var(--muted); font-size: 11px; overflow-wrap: anywhere; line-height: 1.35; white-space: pre-line; }
footer { margin-top: 56px; padding-top: 12px; border-top: 1px solid var(--rule); color: var(--muted); font-size: 12.5px; }
@media print { main { max-width: none; padding: 0; } h2 { break-after: avoid; } }
)";

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
  body_ += "<div class=\"wide\"><table>\n";
  if (!table.caption.empty()) {
    body_ += fmt::format("<caption>{}</caption>\n", escape_markup(table.caption));
  }
  body_ += "<thead>" + row(table.header, "th") + "</thead>\n<tbody>\n";
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const bool strong =
        std::find(table.strong_rows.begin(), table.strong_rows.end(), i) != table.strong_rows.end();
    body_ += row(table.rows[i], "td", strong ? " class=\"strong\"" : "");
  }
  body_ += "</tbody></table></div>\n";
}

void HtmlReport::add_svg(std::string_view svg, std::string_view caption) {
  body_ += figure(svg, caption);
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
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{0}</title>\n<style>{1}</style>\n</head>\n<body>\n<main>\n<header><h1>{0}</h1>\n"
      "<p>{2}</p></header>\n{3}<footer>Written by sdmt {4}</footer>\n</main>\n</body>\n</html>\n",
      escape_markup(title_), kStyle, escape_markup(subtitle_), body_, SDMT_VERSION);
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
