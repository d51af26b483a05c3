#include "daemon/pages/plot/text_layout.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <set>

#include "daemon/base/text/format.hpp"

namespace weft::daemon::svg {
namespace {

// Advance widths of DejaVu Sans [1/1000 of the size], from " " to "~".
constexpr std::array<int, 95> advance{
    318, 401, 460, 838, 637, 951, 780, 275, 391, 391, 500, 838, 318, 361,  318, 337, 637, 637, 637,
    637, 637, 637, 637, 637, 637, 637, 337, 337, 838, 838, 838, 531, 1000, 685, 687, 699, 771, 632,
    576, 775, 752, 295, 295, 656, 558, 863, 749, 788, 604, 788, 695, 635,  611, 732, 685, 989, 686,
    611, 686, 391, 337, 391, 838, 500, 500, 613, 635, 550, 635, 616, 353,  635, 634, 278, 278, 580,
    278, 975, 634, 612, 635, 635, 412, 521, 393, 634, 592, 818, 592, 592,  525, 637, 337, 637, 838};
constexpr double bold_factor = 1.26, ascent = 0.95, descent = 0.25;
constexpr std::string_view ellipsis = "\u2026";

double character_width(std::string_view character) {
  const auto byte = static_cast<unsigned char>(character.front());
  if (byte >= ' ' && byte <= '~') return advance.at(byte - ' ') / 1000.0;
  if (character.size() <= 2) return 1.1;       // Latin, Greek and Cyrillic: "\u0429", "\u0152"
  return character.size() == 3 ? 1.05 : 1.35;  // symbols and ideographs; pictographs
}

std::vector<std::string_view> split_characters(std::string_view text) {
  std::vector<std::string_view> out;
  while (!text.empty()) {
    const std::size_t length = std::max<std::size_t>(1, utf8_length(text));
    out.push_back(text.substr(0, length));
    text.remove_prefix(length);
  }
  return out;
}

std::string join(const std::vector<std::string_view>& characters, std::size_t from,
                 std::size_t to) {
  std::string out;
  for (std::size_t i = from; i < to; ++i) out += characters[i];
  return out;
}

/// Shortens inside the text. `head`: share of the remaining characters before the ellipsis.
std::string shorten_inside(std::string_view text, double room, const TextStyle& style,
                           double head) {
  if (text_width(text, style) <= room) return std::string(text);
  const auto characters = split_characters(text);
  for (std::size_t left = characters.size() - 1; left > 0; --left) {
    const auto front = static_cast<std::size_t>(static_cast<double>(left) * head + 0.5);
    std::string out = join(characters, 0, front) + std::string(ellipsis) +
                      join(characters, characters.size() - (left - front), characters.size());
    if (text_width(out, style) <= room) return out;
  }
  return text_width(ellipsis, style) <= room ? std::string(ellipsis) : std::string();
}

std::size_t count_distinct(const std::vector<std::string>& texts) {
  return std::set<std::string>(texts.begin(), texts.end()).size();
}

/// Adds a number to shortened labels that are equal: "sand…#3".
void number_repeated(std::vector<std::string>& shown, const std::vector<std::string>& labels,
                     double room, const TextStyle& style) {
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const bool repeated = std::ranges::any_of(shown, [&](const std::string& other) {
      const auto k = static_cast<std::size_t>(&other - shown.data());
      return k != i && other == shown[i] && labels[k] != labels[i];
    });
    if (!repeated || shown[i].empty()) continue;
    const std::string number = "#" + std::to_string(i + 1);
    shown[i] = shorten_end(labels[i], room - text_width(number, style), style) + number;
  }
}

Box box_of(Point at, double width, const TextStyle& style, Anchor anchor, bool turned) {
  const double before = anchor == Anchor::start ? 0 : anchor == Anchor::middle ? width / 2 : width;
  const double up = ascent * style.px, height = text_height(style);
  return turned ? Box{at.x - up, at.y - (width - before), height, width}
                : Box{at.x - before, at.y - up, width, height};
}

constexpr std::array all_styles{text::tick,  text::key,   text::axis, text::row,
                                text::panel, text::phase, text::cell, text::share,
                                text::stamp, text::point, text::level};

}  // namespace

std::string text_style_sheet() {
  std::string out;
  for (const TextStyle& style : all_styles)
    out += "svg ." + std::string(style.css_class) + "{font-size:" + coordinate(style.px) + "px" +
           (style.bold ? ";font-weight:700}" : "}");
  return out + "\n";
}

double text_width(std::string_view text, const TextStyle& style) {
  double sum = 0;
  for (const std::string_view character : split_characters(text)) sum += character_width(character);
  return sum * style.px * (style.bold ? bold_factor : 1);
}

double widest(const std::vector<std::string>& texts, const TextStyle& style) {
  double out = 0;
  for (const std::string& one : texts) out = std::max(out, text_width(one, style));
  return out;
}

double text_height(const TextStyle& style) {
  return (ascent + descent) * style.px;
}

std::string shorten_end(std::string_view text, double room, const TextStyle& style) {
  return shorten_inside(text, room, style, 1);
}

std::vector<std::string> shorten_labels(const std::vector<std::string>& labels, double room,
                                        const TextStyle& style) {
  std::vector<std::string> best;
  for (const double head : {0.5, 0.2, 0.8, 1.0}) {
    std::vector<std::string> shown;
    for (const std::string& label : labels)
      shown.push_back(shorten_inside(label, room, style, head));
    if (count_distinct(shown) == count_distinct(labels)) return shown;
    if (count_distinct(shown) > count_distinct(best)) best = std::move(shown);
  }
  number_repeated(best, labels, room, style);
  return best;
}

Sheet::Sheet(double width, double height, std::string_view title, std::string_view css_class,
             bool fixed_size)
    : canvas(width, height, title, css_class, fixed_size), width_(width), height_(height) {}

bool Sheet::is_free(const Box& box) const {
  if (box.x < 0 || box.y < 0 || box.x + box.width > width_ || box.y + box.height > height_)
    return false;
  return std::ranges::none_of(taken_, [&](const Box& other) {
    return box.x < other.x + other.width && other.x < box.x + box.width &&
           box.y < other.y + other.height && other.y < box.y + box.height;
  });
}

bool Sheet::write(Point at, std::string_view shown, const TextStyle& style, Anchor anchor,
                  bool turned, std::string_view full) {
  const Box box = box_of(at, text_width(shown, style), style, anchor, turned);
  if (shown.empty() || !is_free(box)) return false;
  taken_.push_back(box);
  canvas.text(at, shown, style.css_class, anchor, turned, full == shown ? "" : full);
  return true;
}

bool Sheet::write_within(double room, Point at, std::string_view full, const TextStyle& style,
                         Anchor anchor, bool turned) {
  return write(at, shorten_end(full, room, style), style, anchor, turned, full);
}

bool Sheet::write_at_first(const std::vector<Point>& places, std::string_view text,
                           const TextStyle& style) {
  return std::ranges::any_of(places, [&](const Point& corner) {
    return write({corner.x, corner.y + ascent * style.px}, text, style);
  });
}

}  // namespace weft::daemon::svg
