// SPDX-License-Identifier: Apache-2.0
#include "report/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <stdexcept>

namespace sdmt::tools {

namespace {

constexpr std::string_view kFont =
    "-apple-system,BlinkMacSystemFont,'Segoe UI',Inter,Roboto,'Helvetica Neue',Arial,sans-serif";
constexpr std::string_view kInk = "#1f2937";
constexpr std::string_view kMuted = "#6b7280";
constexpr std::string_view kGrid = "#e5e7eb";

// "12.30" -> "12.3": coordinates and tick texts without idle zeros.
std::string number(double value, int digits = 2) {
  std::string text = fmt::format("{:.{}f}", value, digits);
  if (text.find('.') != std::string::npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
  }
  return text == "-0" ? "0" : text;
}

double position(const SvgAxis& axis, double value) {
  if (!axis.logarithmic) return (value - axis.low) / (axis.high - axis.low);
  const double clamped = std::max(value, axis.low * 1e-3);  // zero has no logarithm
  return std::log(clamped / axis.low) / std::log(axis.high / axis.low);
}

// Four to eight round numbers, or the powers of ten.
std::vector<double> chosen_ticks(const SvgAxis& axis) {
  if (!axis.ticks.empty()) return axis.ticks;
  std::vector<double> ticks;
  constexpr double kSlack = 1e-9;
  if (axis.logarithmic) {
    for (double e = std::ceil(std::log10(axis.low) - kSlack); e <= std::log10(axis.high) + kSlack;
         ++e) {
      ticks.push_back(std::pow(10.0, e));
    }
    return ticks;
  }
  const double span = axis.high - axis.low;
  const double power = std::pow(10.0, std::floor(std::log10(span / 4)));
  double step = power;
  for (const double factor : {2.0, 2.5, 5.0}) {
    if (span / step > 7) step = factor * power;
  }
  const double first = std::ceil(axis.low / step - kSlack);
  for (int i = 0; (first + i) * step <= axis.high + kSlack * span; ++i) {
    ticks.push_back((first + i) * step);
  }
  return ticks;
}

std::string tick_label(const SvgAxis& axis, const std::vector<double>& ticks, std::size_t i) {
  if (!axis.tick_labels.empty()) return escape_markup(axis.tick_labels.at(i));
  if (axis.percent) return number(100 * ticks[i], 3) + "%";
  return std::abs(ticks[i]) >= 1e5 ? fmt::format("{:.0e}", ticks[i]) : number(ticks[i], 6);
}

std::string text(double x, double y, std::string_view anchor, std::string_view attributes,
                 std::string_view content) {
  return fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"{}\" {}>{}</text>\n", number(x),
                     number(y), anchor, attributes, content);
}

std::string line(double x1, double y1, double x2, double y2, std::string_view attributes) {
  return fmt::format("<line x1=\"{}\" y1=\"{}\" x2=\"{}\" y2=\"{}\" {}/>\n", number(x1), number(y1),
                     number(x2), number(y2), attributes);
}

std::string document(int width, int height, std::string_view label, std::string_view content) {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" "
      "height=\"{1}\" role=\"img\" aria-label=\"{2}\" font-family=\"{3}\" font-size=\"12\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n{4}</svg>\n",
      width, height, escape_markup(label), kFont, content);
}

std::string dash_attribute(const std::string& dashes) {
  return dashes.empty() ? "" : fmt::format(" stroke-dasharray=\"{}\"", dashes);
}

void check(const SvgAxis& axis) {
  if (!(axis.low < axis.high) || (axis.logarithmic && axis.low <= 0)) {
    throw std::invalid_argument(
        fmt::format("plot axis \"{}\" from {} to {}: expected low < high, and low > 0 when "
                    "logarithmic",
                    axis.label, axis.low, axis.high));
  }
}

// Of a legend's text, in pixels, roughly: capitals are wide.
double text_width(std::string_view text) {
  double width = 0;
  for (const char c : text) width += c >= 'A' && c <= 'Z' ? 8.6 : 6.2;
  return width;
}

}  // namespace

std::string escape_markup(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      case '\'':
        result += "&#39;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

std::string series_color(std::size_t i) {
  constexpr std::array<const char*, 8> kPalette = {"#1d4ed8", "#c2410c", "#0f766e", "#a16207",
                                                   "#7e22ce", "#be185d", "#475569", "#4d7c0f"};
  return kPalette[i % kPalette.size()];
}

std::string series_dashes(std::size_t i) {
  constexpr std::array<const char*, 6> kDashes = {"", "7 3", "2 2.5", "9 3 2 3", "13 4", "4 2 1 2"};
  return kDashes[i % kDashes.size()];
}

SvgPlot::SvgPlot(SvgPlotOptions options) : options_(std::move(options)) {
  check(options_.x);
  check(options_.y);
  left_ = 58;
  top_ = options_.title.empty() ? 14 : 38;
  right_ = options_.width - 16;
  bottom_ = options_.height - (options_.x.label.empty() ? 28 : 46);
}

double SvgPlot::pixel_x(double x) const {
  return left_ + (right_ - left_) * position(options_.x, x);
}

double SvgPlot::pixel_y(double y) const {
  return bottom_ - (bottom_ - top_) * position(options_.y, y);
}

std::string SvgPlot::next_color(std::string color) {
  return color.empty() ? series_color(colors_++) : std::move(color);
}

// What lies between two pixels is now something that a legend would hide.
void SvgPlot::add_drawn(SvgPoint from, SvgPoint to) {
  constexpr double kStep = 4;
  const double length = std::hypot(to.x - from.x, to.y - from.y);
  const int steps = 1 + static_cast<int>(length / kStep);
  for (int i = 0; i <= steps; ++i) {
    const double share = static_cast<double>(i) / steps;
    drawn_.push_back({from.x + share * (to.x - from.x), from.y + share * (to.y - from.y)});
  }
}

void SvgPlot::add_line(std::string name, std::span<const SvgPoint> points, std::string color) {
  color = next_color(std::move(color));
  std::string path;
  double last_x = 0;
  double last_y = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double x = pixel_x(points[i].x);
    const double y = pixel_y(points[i].y);
    const bool ends = i == 0 || i + 1 == points.size();
    if (!ends && std::abs(x - last_x) < 0.5 && std::abs(y - last_y) < 0.5) continue;
    path += fmt::format("{}{} {}", path.empty() ? "M" : "L", number(x), number(y));
    if (i > 0) add_drawn({last_x, last_y}, {x, y});
    last_x = x;
    last_y = y;
  }
  const std::string dashes = series_dashes(entries_.size());
  data_ += fmt::format(
      "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\" "
      "stroke-linejoin=\"round\"{}/>\n",
      path, color, dash_attribute(dashes));
  entries_.push_back({std::move(name), color, dashes});
}

void SvgPlot::add_bars(std::string name, double left, double step, double width,
                       std::span<const double> values, std::string color) {
  color = next_color(std::move(color));
  const bool touching = width >= step;
  const double base = bottom_;
  std::string area;
  std::string outline;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double from = left + static_cast<double>(i) * step;
    const double x0 = pixel_x(from);
    const double x1 = pixel_x(from + width);
    const double y = pixel_y(values[i]);
    add_drawn({(x0 + x1) / 2, y}, {(x0 + x1) / 2, base});
    if (touching) {
      outline += fmt::format("{}{} {}H{}", i == 0 ? "M" : "L", number(x0), number(y), number(x1));
    } else {
      area += fmt::format("M{} {}V{}H{}V{}Z", number(x0), number(base), number(y), number(x1),
                          number(base));
    }
  }
  if (touching && !values.empty()) {
    const double end = pixel_x(left + static_cast<double>(values.size()) * step);
    area = fmt::format("{}L{} {}H{}Z", outline, number(end), number(base), number(pixel_x(left)));
  }
  data_ += fmt::format("<path d=\"{}\" fill=\"{}\" fill-opacity=\"{}\"/>\n", area, color,
                       touching ? "0.22" : "0.85");
  const std::string dashes = touching ? series_dashes(entries_.size()) : "";
  if (touching) {
    data_ += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"{}/>\n",
                         outline, color, dash_attribute(dashes));
  }
  entries_.push_back({std::move(name), color, dashes});
}

void SvgPlot::add_vertical_line(double x, std::string label, std::string color) {
  const double at = pixel_x(x);
  if (at < left_ || at > right_) return;
  data_ += line(at, top_, at, bottom_,
                fmt::format("stroke=\"{}\" stroke-width=\"1.25\" stroke-dasharray=\"4 3\"", color));
  const double length = 7.0 * static_cast<double>(label.size());
  const bool fits_right = right_ - at > length;
  add_drawn({at, top_}, {at, bottom_});
  add_drawn({at, top_ + 10}, {fits_right ? at + length : at - length, top_ + 10});
  labels_ += text(at + (fits_right ? 6 : -6), top_ + 13, fits_right ? "start" : "end",
                  fmt::format("fill=\"{}\" stroke=\"#ffffff\" stroke-width=\"3\" "
                              "paint-order=\"stroke\" font-size=\"11.5\"",
                              color),
                  escape_markup(label));
}

void SvgPlot::add_marker(SvgPoint at, std::string name, std::string color) {
  color = next_color(std::move(color));
  data_ += fmt::format(
      "<circle cx=\"{}\" cy=\"{}\" r=\"4\" fill=\"#ffffff\" stroke=\"{}\" stroke-width=\"2\"/>\n",
      number(pixel_x(at.x)), number(pixel_y(at.y)), color);
  entries_.push_back({std::move(name), color, ""});
}

std::string SvgPlot::legend() const {
  std::vector<Entry> named;
  std::copy_if(entries_.begin(), entries_.end(), std::back_inserter(named),
               [](const Entry& entry) { return !entry.name.empty(); });
  if (named.empty() || options_.legend == LegendCorner::none) return {};
  double longest = 0;
  for (const Entry& entry : named) longest = std::max(longest, text_width(entry.name));
  constexpr double kRow = 18;
  const double width = 50 + longest;
  const double height = kRow * static_cast<double>(named.size()) + 8;
  const auto corner = [&](LegendCorner where) {
    const bool at_left = where == LegendCorner::top_left || where == LegendCorner::bottom_left;
    const bool at_top = where == LegendCorner::top_left || where == LegendCorner::top_right;
    return SvgPoint{at_left ? left_ + 10 : right_ - 10 - width,
                    at_top ? top_ + 10 : bottom_ - 10 - height};
  };
  const auto hidden = [&](SvgPoint at) {
    return std::count_if(drawn_.begin(), drawn_.end(), [&](SvgPoint p) {
      return p.x >= at.x && p.x <= at.x + width && p.y >= at.y && p.y <= at.y + height;
    });
  };
  SvgPoint best = corner(options_.legend);
  for (const auto where : {LegendCorner::top_left, LegendCorner::top_right,
                           LegendCorner::bottom_left, LegendCorner::bottom_right}) {
    if (hidden(corner(where)) < hidden(best)) best = corner(where);
  }
  const auto [x, y] = best;
  std::string result = fmt::format(
      "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" rx=\"4\" fill=\"#ffffff\" "
      "fill-opacity=\"0.88\" stroke=\"{}\"/>\n",
      number(x), number(y), number(width), number(height), kGrid);
  for (std::size_t i = 0; i < named.size(); ++i) {
    const double row = y + 4 + kRow * (static_cast<double>(i) + 0.5);
    result += line(x + 8, row, x + 34, row,
                   fmt::format("stroke=\"{}\" stroke-width=\"3\"{}", named[i].color,
                               dash_attribute(named[i].dashes)));
    result += text(x + 41, row + 4, "start", fmt::format("fill=\"{}\" font-size=\"11.5\"", kInk),
                   escape_markup(named[i].name));
  }
  return result;
}

std::string SvgPlot::body() const {
  std::string out;
  if (!options_.title.empty()) {
    out += text(left_, 22, "start",
                fmt::format("fill=\"{}\" font-size=\"14\" font-weight=\"600\"", kInk),
                escape_markup(options_.title));
  }
  const std::string grid = fmt::format("stroke=\"{}\"", kGrid);
  const std::string tick_style = fmt::format("fill=\"{}\" font-size=\"11\"", kMuted);
  const auto x_ticks = chosen_ticks(options_.x);
  for (std::size_t i = 0; i < x_ticks.size(); ++i) {
    const double x = pixel_x(x_ticks[i]);
    if (options_.x.tick_labels.empty()) out += line(x, top_, x, bottom_, grid);
    out += text(x, bottom_ + 16, "middle", tick_style, tick_label(options_.x, x_ticks, i));
  }
  const auto y_ticks = chosen_ticks(options_.y);
  for (std::size_t i = 0; i < y_ticks.size(); ++i) {
    const double y = pixel_y(y_ticks[i]);
    out += line(left_, y, right_, y, grid);
    out += text(left_ - 8, y + 4, "end", tick_style, tick_label(options_.y, y_ticks, i));
  }
  const std::string label_style = fmt::format("fill=\"{}\"", kInk);
  out += text(0.5 * (left_ + right_), options_.height - 10, "middle", label_style,
              escape_markup(options_.x.label));
  const double middle = 0.5 * (top_ + bottom_);
  out += text(14, middle, "middle",
              fmt::format("{} transform=\"rotate(-90 14 {})\"", label_style, number(middle)),
              escape_markup(options_.y.label));
  // A nested <svg> cuts what leaves the axes; unlike a clip path it needs no id.
  out += fmt::format(
      "<svg x=\"{0}\" y=\"{1}\" width=\"{2}\" height=\"{3}\" viewBox=\"{0} {1} {2} {3}\">\n{4}"
      "</svg>\n",
      number(left_), number(top_), number(right_ - left_), number(bottom_ - top_), data_);
  out += line(left_, bottom_, right_, bottom_, "stroke=\"#9ca3af\"");
  out += line(left_, top_, left_, bottom_, "stroke=\"#9ca3af\"");
  return out + labels_ + legend();
}

std::string SvgPlot::str() const {
  return document(options_.width, options_.height, options_.title, body());
}

std::string svg_figure(std::span<const SvgPlot> panels, int columns) {
  std::string content;
  std::string label;
  int width = 0;
  int height = 0;
  for (std::size_t begin = 0; begin < panels.size(); begin += static_cast<std::size_t>(columns)) {
    int x = 0;
    int row_height = 0;
    const std::size_t end = std::min(panels.size(), begin + static_cast<std::size_t>(columns));
    for (std::size_t i = begin; i < end; ++i) {
      content +=
          fmt::format("<g transform=\"translate({} {})\">\n{}</g>\n", x, height, panels[i].body());
      label += (label.empty() ? "" : "; ") + panels[i].options().title;
      x += panels[i].options().width;
      row_height = std::max(row_height, panels[i].options().height);
    }
    width = std::max(width, x);
    height += row_height;
  }
  return document(width, height, label, content);
}

}  // namespace sdmt::tools
