#pragma once
// Scalable vector graphics for the report's figures. Colours are CSS classes, so that light and
// dark pages share one drawing; see style.cpp.

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace weft::daemon::svg {

struct Point {
  double x = 0;
  double y = 0;
};

struct Box {
  double x = 0;
  double y = 0;
  double width = 0;
  double height = 0;
};

enum class Anchor { start, middle, end };

/// One <svg> element in user units, origin top left. Coordinates that are not finite are left out
/// of lines and drawn at 0 elsewhere: no "nan" reaches the page.
class Canvas {
 public:
  /// `title` is read out instead of the picture and must describe it. `fixed_size`: as wide on the
  /// page as in user units.
  Canvas(double width, double height, std::string_view title, std::string_view css_class = {},
         bool fixed_size = false);

  void rect(const Box& box, std::string_view css_class, double opacity = 1);
  void line(Point from, Point to, std::string_view css_class);
  /// A point that is not finite makes a gap.
  void polyline(std::span<const Point> points, std::string_view css_class);
  void circle(Point centre, double radius, std::string_view css_class);
  /// Escapes the text. `turned`: a quarter turn anticlockwise about `at`. `full`: tool tip.
  /// Sheet::write() avoids overlaps of texts.
  void text(Point at, std::string_view text, std::string_view css_class,
            Anchor anchor = Anchor::start, bool turned = false, std::string_view full = {});
  /// A path of commands that this program makes: "M1 2h3v1z".
  void path(std::string_view commands, std::string_view css_class, double opacity = 1);
  /// A diamond, for marks that must differ from circles without colour.
  void diamond(Point centre, double radius, std::string_view css_class);

  /// Closes the element. The canvas is empty afterwards.
  [[nodiscard]] std::string finish();

 private:
  std::string out_;
};

struct Range {
  double low = 0;
  double high = 1;
};

/// Range of the finite values, widened by `margin` of itself; never empty.
Range find_range(std::span<const double> values, double margin = 0.05);

/// Range of the positive finite values for a logarithmic scale, widened by `margin` of its decades
/// (at least half an octave); {0.5, 2} without such values.
Range log_range_of(std::span<const double> values, double margin = 0.05);

/// Maps data to the pixels of one direction.
struct Scale {
  Range data;
  double from = 0;  ///< position of data.low
  double to = 1;
  bool logarithmic = false;  ///< data.low must be positive; other values have no position (NaN)
  [[nodiscard]] double operator()(double value) const;
};

struct Ticks {
  std::vector<double> at;
  int decimals = 0;  ///< number that makes the labels distinct
};

/// About `count` round numbers (1, 2 or 5 times a power of ten apart) within `range`.
Ticks ticks(const Range& range, int count);

/// 1, 2 and 5 times powers of ten within `range` (low positive); only powers of ten if that would
/// be more than `most`.
std::vector<double> log_ticks(const Range& range, std::size_t most = 10);

}  // namespace weft::daemon::svg
