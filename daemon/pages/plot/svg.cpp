#include "daemon/pages/plot/svg.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "daemon/base/text/format.hpp"

namespace weft::daemon::svg {
namespace {

std::string attribute(std::string_view name, double value) {
  return " " + std::string(name) + "=\"" + coordinate(value) + "\"";
}

std::string class_of(std::string_view css_class) {
  return css_class.empty() ? std::string() : " class=\"" + escape(css_class) + "\"";
}

bool finite(Point p) {
  return std::isfinite(p.x) && std::isfinite(p.y);
}

std::string pair(Point p) {
  return coordinate(p.x) + " " + coordinate(p.y);
}

std::string_view anchor_name(Anchor anchor) {
  switch (anchor) {
    case Anchor::start:
      return {};
    case Anchor::middle:
      return " text-anchor=\"middle\"";
    case Anchor::end:
      return " text-anchor=\"end\"";
  }
  return {};
}

}  // namespace

Canvas::Canvas(double width, double height, std::string_view title, std::string_view css_class,
               bool fixed_size) {
  out_ = "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" viewBox=\"0 0 " +
         coordinate(width) + " " + coordinate(height) + "\"" + class_of(css_class);
  if (fixed_size) out_ += attribute("width", width) + attribute("height", height);
  out_ += "><title>" + escape(title) + "</title>\n";
}

void Canvas::rect(const Box& box, std::string_view css_class, double opacity) {
  out_ += "<rect" + class_of(css_class) + attribute("x", box.x) + attribute("y", box.y) +
          attribute("width", std::max(0.0, box.width)) +
          attribute("height", std::max(0.0, box.height));
  if (opacity < 1) out_ += attribute("fill-opacity", opacity);
  out_ += "/>\n";
}

void Canvas::line(Point from, Point to, std::string_view css_class) {
  if (!finite(from) || !finite(to)) return;
  out_ += "<line" + class_of(css_class) + attribute("x1", from.x) + attribute("y1", from.y) +
          attribute("x2", to.x) + attribute("y2", to.y) + "/>\n";
}

void Canvas::polyline(std::span<const Point> points, std::string_view css_class) {
  std::string path;
  bool pen_down = false;
  for (const Point& p : points) {
    if (finite(p)) path += (pen_down ? "L" : "M") + pair(p);
    pen_down = finite(p);
  }
  if (!path.empty()) out_ += "<path" + class_of(css_class) + " d=\"" + path + "\"/>\n";
}

void Canvas::circle(Point centre, double radius, std::string_view css_class) {
  out_ += "<circle" + class_of(css_class) + attribute("cx", centre.x) + attribute("cy", centre.y) +
          attribute("r", radius) + "/>\n";
}

void Canvas::diamond(Point centre, double radius, std::string_view css_class) {
  const auto [x, y] = centre;
  out_ += "<path" + class_of(css_class) + " d=\"M" + pair({x, y - radius}) + "L" +
          pair({x + radius, y}) + "L" + pair({x, y + radius}) + "L" + pair({x - radius, y}) +
          "Z\"/>\n";
}

void Canvas::text(Point at, std::string_view text, std::string_view css_class, Anchor anchor,
                  bool turned, std::string_view full) {
  out_ += "<text" + class_of(css_class) + attribute("x", at.x) + attribute("y", at.y) +
          std::string(anchor_name(anchor));
  if (turned) out_ += " transform=\"rotate(-90 " + pair(at) + ")\"";
  out_ += ">";
  if (!full.empty()) out_ += "<title>" + escape(full) + "</title>";
  out_ += escape(text) + "</text>\n";
}

void Canvas::path(std::string_view commands, std::string_view css_class, double opacity) {
  if (commands.empty()) return;
  out_ += "<path" + class_of(css_class) + " d=\"" + std::string(commands) + "\"";
  if (opacity < 1) out_ += attribute("fill-opacity", opacity);
  out_ += "/>\n";
}

std::string Canvas::finish() {
  return std::move(out_) + "</svg>\n";
}

Range find_range(std::span<const double> values, double margin) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Range out{infinity, -infinity};
  for (const double v : values) {
    if (!std::isfinite(v)) continue;
    out.low = std::min(out.low, v);
    out.high = std::max(out.high, v);
  }
  if (out.low > out.high) return {};
  const double width = out.high - out.low;
  const double pad = width > 0 ? width * margin : std::max(0.5, std::abs(out.low) * margin);
  return {out.low - pad, out.high + pad};
}

Range log_range_of(std::span<const double> values, double margin) {
  std::vector<double> decades;
  for (const double v : values)
    if (v > 0 && std::isfinite(v)) decades.push_back(std::log10(v));
  if (decades.empty()) return {0.5, 2};
  const auto [least, most] = std::minmax_element(decades.begin(), decades.end());
  const double pad = std::max((*most - *least) * margin, 0.5 * std::log10(2.0));
  return {std::pow(10.0, *least - pad), std::pow(10.0, *most + pad)};
}

double Scale::operator()(double value) const {
  if (logarithmic)
    return from + (to - from) * std::log(value / data.low) / std::log(data.high / data.low);
  return from + (to - from) * (value - data.low) / (data.high - data.low);
}

Ticks ticks(const Range& range, int count) {
  Ticks out;
  const double width = range.high - range.low;
  if (!(width > 0) || !std::isfinite(width) || count < 1) return out;
  const double raw = width / count;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  double step = 10 * power;
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power < raw * 0.999) continue;
    step = factor * power;
    break;
  }
  out.decimals = std::max(0, static_cast<int>(std::ceil(-std::log10(step) - 1e-9)));
  const double first = std::ceil(range.low / step - 1e-9);
  for (double k = first; k * step <= range.high + 1e-9 * width && out.at.size() < 100; ++k)
    out.at.push_back(k * step);
  return out;
}

std::vector<double> log_ticks(const Range& range, std::size_t most) {
  std::vector<double> fine, coarse;
  if (!(range.low > 0) || !(range.high > range.low) || !std::isfinite(range.high)) return fine;
  const double slack = 1 + 1e-9;
  for (double k = std::floor(std::log10(range.low)); k <= std::log10(range.high); ++k)
    for (const double factor : {1.0, 2.0, 5.0}) {
      const double at = factor * std::pow(10.0, k);
      if (at * slack < range.low || at > range.high * slack) continue;
      fine.push_back(at);
      if (factor == 1.0) coarse.push_back(at);
    }
  return fine.size() > most ? coarse : fine;
}

}  // namespace weft::daemon::svg
