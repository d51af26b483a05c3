#pragma once
// Where text of a picture goes. Widths are estimated from the widest of the usual fonts (DejaVu
// Sans), so that what fits here fits in a browser; no text overlaps another or leaves the picture.

#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/pages/plot/svg.hpp"

namespace weft::daemon::svg {

/// A class of text with its size [user units], for the style sheet and for placing alike.
struct TextStyle {
  std::string_view css_class;
  double px = 12;
  bool bold = false;
};

namespace text {
inline constexpr TextStyle tick{"tick", 11}, key{"key", 11.5}, axis{"axis-title", 12},
    row{"row-name", 12.5}, panel{"panel-name", 12.5, true}, phase{"phase-name", 10.5, true},
    cell{"cell-text", 10.5}, cell_on{"cell-text on", 10.5}, share{"share-text", 13, true},
    stamp{"stamp", 12, true}, point{"front-name", 11.5, true}, level{"level-name", 11.5};
}  // namespace text

/// "svg .tick{font-size:11px}..." of all styles.
std::string text_style_sheet();

/// Upper estimate [user units] for UTF-8 text.
double text_width(std::string_view text, const TextStyle& style);
/// The width of the widest.
double widest(const std::vector<std::string>& texts, const TextStyle& style);
/// From the top of the tallest letter to the bottom of the lowest.
double text_height(const TextStyle& style);

/// `text` where it fits into `room`; else its beginning and "…"; empty where not even that fits.
std::string shorten_end(std::string_view text, double room, const TextStyle& style);
/// Labels that fit into `room`: shortened in the middle, and labels that differ stay different.
std::vector<std::string> shorten_labels(const std::vector<std::string>& labels, double room,
                                        const TextStyle& style);

/// A picture whose texts keep clear of each other and of its edge.
class Sheet {
 public:
  /// `fixed_size`: as wide on the page as it is in user units, not stretched.
  Sheet(double width, double height, std::string_view title, std::string_view css_class,
        bool fixed_size = false);

  /// Lines, marks and areas: not checked.
  Canvas canvas;

  /// Writes `shown`, whole text `full` (as a tool tip where it differs). Left out, with false,
  /// where it would overlap a text or reserved() box or leave the picture.
  bool write(Point at, std::string_view shown, const TextStyle& style,
             Anchor anchor = Anchor::start, bool turned = false, std::string_view full = {});
  /// The same, shortened at its end to `room`.
  bool write_within(double room, Point at, std::string_view full, const TextStyle& style,
                    Anchor anchor = Anchor::start, bool turned = false);
  /// The first of `places` (top left corners) that is free.
  bool write_at_first(const std::vector<Point>& places, std::string_view text,
                      const TextStyle& style);
  /// No text will be written over `box`.
  void reserve(const Box& box) { taken_.push_back(box); }

 private:
  [[nodiscard]] bool is_free(const Box& box) const;
  double width_, height_;
  std::vector<Box> taken_;
};

}  // namespace weft::daemon::svg
