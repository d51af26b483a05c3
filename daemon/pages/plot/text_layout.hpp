#pragma once
// Places text in a picture. Widths are estimated from the widest of the usual fonts (DejaVu Sans):
// text that fits here also fits in a browser. No text overlaps another or leaves the picture.

#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/pages/plot/svg.hpp"

namespace weft::daemon::svg {

/// A class of text with its size [user units], for both the style sheet and the layout.
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

/// "svg .tick{font-size:11px}..." for all styles.
std::string text_style_sheet();

/// Upper estimate [user units] for UTF-8 text.
double text_width(std::string_view text, const TextStyle& style);
/// Width of the widest text [user units].
double widest(const std::vector<std::string>& texts, const TextStyle& style);
/// From the top of the tallest letter to the bottom of the lowest [user units].
double text_height(const TextStyle& style);

/// `text` if it fits into `room`; otherwise its beginning and "…"; empty if not even that fits.
std::string shorten_end(std::string_view text, double room, const TextStyle& style);
/// Labels that fit into `room`: shortened in the middle; different labels stay different.
std::vector<std::string> shorten_labels(const std::vector<std::string>& labels, double room,
                                        const TextStyle& style);

/// A picture without overlaps of texts with each other or with its edge.
class Sheet {
 public:
  /// `fixed_size`: as wide on the page as in user units, not stretched.
  Sheet(double width, double height, std::string_view title, std::string_view css_class,
        bool fixed_size = false);

  /// For lines, marks and areas: not checked.
  Canvas canvas;

  /// Writes `shown`; `full` is the whole text (a tool tip if it differs). Leaves it out and returns
  /// false if it would overlap a text or a reserved() box, or leave the picture.
  bool write(Point at, std::string_view shown, const TextStyle& style,
             Anchor anchor = Anchor::start, bool turned = false, std::string_view full = {});
  /// The same, shortened at its end to `room`.
  bool write_within(double room, Point at, std::string_view full, const TextStyle& style,
                    Anchor anchor = Anchor::start, bool turned = false);
  /// Writes at the first of `places` (top left corners) that is free.
  bool write_at_first(const std::vector<Point>& places, std::string_view text,
                      const TextStyle& style);
  /// Prevents later texts over `box`.
  void reserve(const Box& box) { taken_.push_back(box); }

 private:
  [[nodiscard]] bool is_free(const Box& box) const;
  double width_, height_;
  std::vector<Box> taken_;
};

}  // namespace weft::daemon::svg
