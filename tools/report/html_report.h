// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "report/svg_plot.h"

namespace sdmt::tools {

/// The first column is text, set left; the others are numbers, set right.
struct HtmlTable {
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;
  std::string caption;
  /// Rows set bold, by index.
  std::vector<std::size_t> strong_rows = {};
};

/// A large figure at the top of a report: "0.983", "AUC", "95 %: 0.979 to 0.987".
struct HtmlNumber {
  std::string value;
  std::string label;
  std::string note;
};

/// A card of a gallery: pictures side by side over a caption.
struct HtmlCard {
  std::vector<std::string> images;  ///< data_uri() each
  std::string caption;
  std::string note;  ///< may have several lines
};

/// One HTML page that needs no other file: style, plots and pictures are inside. It fits screens
/// from a telephone's on, light or dark, and ends with the command that made it. All texts given to
/// it are escaped; only add_svg() takes markup.
class HtmlReport {
 public:
  HtmlReport(std::string title, std::string subtitle);

  void add_heading(std::string_view text);
  void add_paragraph(std::string_view text);
  void add_numbers(std::span<const HtmlNumber> numbers);
  void add_table(const HtmlTable& table);
  /// Plots side by side where the page is wide enough, else below each other.
  void add_plots(std::span<const SvgPlot> plots, std::string_view caption = {});
  /// A drawing of 700 pixels or more, which is scrolled on a small screen.
  void add_svg(std::string_view svg, std::string_view caption = {});
  void add_image(std::string_view uri, std::string_view caption = {});
  void add_gallery(std::span<const HtmlCard> cards);

  std::string str() const;

 private:
  std::string title_;
  std::string subtitle_;
  std::string body_;
};

/// "data:image/png;base64,..." for bytes of that media type.
std::string data_uri(std::string_view media_type, std::span<const std::uint8_t> bytes);

}  // namespace sdmt::tools
