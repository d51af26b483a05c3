#pragma once
// Scalable vector graphics, as much as the report's figures need. Colours are CSS classes, so that
// light and dark pages share one drawing; see html.cpp.

#include <functional>
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
  /// `title` is read out in place of the picture and must say what it shows.
  Canvas(double width, double height, std::string_view title, std::string_view css_class = {});

  void rect(const Box& box, std::string_view css_class, double opacity = 1);
  void line(Point from, Point to, std::string_view css_class);
  /// A gap wherever a point is not finite.
  void polyline(std::span<const Point> points, std::string_view css_class);
  void circle(Point centre, double radius, std::string_view css_class);
  /// Escaped. `turned`: a quarter turn against the clock about `at`.
  void text(Point at, std::string_view text, std::string_view css_class,
            Anchor anchor = Anchor::start, bool turned = false);
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

/// The finite values' range, widened by `margin` of itself; never empty.
Range find_range(std::span<const double> values, double margin = 0.05);

/// The positive finite values' range for a logarithmic scale, widened by `margin` of its decades
/// (by half an octave at least); {0.5, 2} without such values.
Range log_range_of(std::span<const double> values, double margin = 0.05);

/// From data to the pixels of one direction.
struct Scale {
  Range data;
  double from = 0;  ///< where data.low is drawn
  double to = 1;
  bool logarithmic = false;  ///< data.low must be positive; values that are not have no place (NaN)
  [[nodiscard]] double operator()(double value) const;
};

struct Ticks {
  std::vector<double> at;
  int decimals = 0;  ///< that tell the labels apart
};

/// About `count` round numbers (1, 2 or 5 times a power of ten apart) within `range`.
Ticks ticks(const Range& range, int count);

/// 1, 2 and 5 times powers of ten within `range` (low positive); powers of ten alone where those
/// would be more than `most`.
std::vector<double> log_ticks(const Range& range, std::size_t most = 10);

/// A plotting area with grid lines, tick labels and axis titles with units.
struct Axes {
  Box area;
  Scale x;
  Scale y;

  Axes(const Box& box, const Range& x_range, const Range& y_range);
  [[nodiscard]] Point at(double x_value, double y_value) const { return {x(x_value), y(y_value)}; }
  void draw_x(Canvas& canvas, std::string_view title, int tick_count) const;
  /// For a logarithmic x; `label` writes a tick's value.
  void draw_log_x(Canvas& canvas, std::string_view title,
                  const std::function<std::string(double)>& label) const;
  void draw_y(Canvas& canvas, std::string_view title, int tick_count) const;
  /// For a logarithmic y.
  void draw_log_y(Canvas& canvas, std::string_view title,
                  const std::function<std::string(double)>& label) const;
  void draw_log_y_grid(Canvas& canvas) const;
  /// The lines of draw_y() alone, for a panel beside one that has the labels.
  void draw_y_grid(Canvas& canvas, int tick_count) const;

 private:
  void draw_tick(Canvas& canvas, double value, std::string_view label) const;
  void draw_bottom(Canvas& canvas, std::string_view title) const;
};

}  // namespace weft::daemon::svg
