// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace sdmt::tools {

/// Text made safe for SVG and HTML, in elements and in quoted attributes.
std::string escape_markup(std::string_view text);

/// Colour number i of the reports' palette, "#rrggbb"; goes round after eight.
std::string series_color(std::size_t i);

/// Dashes of line number i for those to whom colours are alike, as a stroke-dasharray; empty for
/// the first. Goes round after six.
std::string series_dashes(std::size_t i);

struct SvgAxis {
  std::string label;
  double low = 0;
  double high = 1;           ///< > low
  bool logarithmic = false;  ///< then low > 0 and ticks stand at powers of ten
  bool percent = false;      ///< 0.25 is written 25 %
  /// Where ticks stand; chosen when empty.
  std::vector<double> ticks = {};
  /// Their texts, as many as ticks; numbers when empty. For names of sequences and the like.
  std::vector<std::string> tick_labels = {};
};

struct SvgPoint {
  double x = 0;
  double y = 0;
};

/// Where the legend stands, unless it would hide more there than in another corner. Entries without
/// a name do not appear in it.
enum class LegendCorner { none, top_left, top_right, bottom_left, bottom_right };

struct SvgPlotOptions {
  std::string title;
  SvgAxis x;
  SvgAxis y;
  int width = 460;  ///< of the whole panel with its labels, in pixels
  int height = 360;
  LegendCorner legend = LegendCorner::bottom_right;
};

/// One panel: two axes with grid, and what is drawn between them (cut at the axes). An empty colour
/// takes the next of the palette.
class SvgPlot {
 public:
  /// Throws std::invalid_argument for an empty range, or a logarithmic axis that reaches zero.
  explicit SvgPlot(SvgPlotOptions options);

  /// A line through the points, dashed by its number. Points closer than half a pixel are left out.
  void add_line(std::string name, std::span<const SvgPoint> points, std::string color = "");
  /// Bars from zero to values[i] over [left + i * step, left + i * step + width]. Translucent, so
  /// that two histograms can overlap; with width == step they touch and share one outline.
  void add_bars(std::string name, double left, double step, double width,
                std::span<const double> values, std::string color = "");
  /// A dashed line across the panel at x with a label at its upper end.
  void add_vertical_line(double x, std::string label, std::string color = "#374151");
  /// A small ring at a point.
  void add_marker(SvgPoint at, std::string name, std::string color = "");

  const SvgPlotOptions& options() const { return options_; }
  /// The panel as an SVG document.
  std::string str() const;
  /// The same without the outer <svg>, for svg_figure().
  std::string body() const;

 private:
  struct Entry {
    std::string name;
    std::string color;
    std::string dashes;  // a stroke-dasharray, or empty
  };
  double pixel_x(double x) const;
  double pixel_y(double y) const;
  std::string next_color(std::string color);
  void add_drawn(SvgPoint from, SvgPoint to);
  std::string legend() const;

  SvgPlotOptions options_;
  double left_, top_, right_, bottom_;  // the rectangle between the axes, in pixels
  std::string data_;                    // what is drawn between the axes
  std::string labels_;                  // what may reach beyond them
  std::vector<Entry> entries_;
  std::vector<SvgPoint> drawn_;  // along all that is drawn, in pixels
  std::size_t colors_ = 0;
};

/// Panels side by side, `columns` in a row, as one SVG document.
std::string svg_figure(std::span<const SvgPlot> panels, int columns);

}  // namespace sdmt::tools
