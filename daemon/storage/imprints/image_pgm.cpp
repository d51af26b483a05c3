#include <algorithm>
#include <charconv>
#include <optional>

#include "daemon/storage/imprints/image_file.hpp"

namespace weft::daemon {
namespace {

using classifier::imprint::Image;

constexpr std::string_view map_blanks = " \t\r\n\v\f";
constexpr std::size_t largest_map_value = 65535;

// Words of a grey map's text part; a comment goes from # to the end of its line.
class GreyMapTokens {
 public:
  explicit GreyMapTokens(std::string_view text) : text_(text) {}

  std::optional<std::size_t> number() {
    skip();
    std::size_t out = 0;
    const auto [stopped, error] =
        std::from_chars(text_.data() + at_, text_.data() + text_.size(), out);
    if (error != std::errc()) return std::nullopt;
    at_ = static_cast<std::size_t>(stopped - text_.data());
    return out;
  }
  /// Whether a white character follows the last number: of `127` a cut leaves `12`, a number too.
  [[nodiscard]] bool is_ended() const {
    return at_ < text_.size() && map_blanks.find(text_[at_]) != std::string_view::npos;
  }
  /// Whether nothing follows but comments.
  [[nodiscard]] bool is_at_end() {
    skip();
    return at_ == text_.size();
  }
  /// What follows the single white character behind the last number.
  [[nodiscard]] std::string_view rest() const {
    return at_ < text_.size() ? text_.substr(at_ + 1) : std::string_view{};
  }

 private:
  // White characters and comments.
  void skip() {
    for (;;) {
      at_ = std::min(text_.find_first_not_of(map_blanks, at_), text_.size());
      if (at_ == text_.size() || text_[at_] != '#') return;
      at_ = std::min(text_.find('\n', at_), text_.size());
    }
  }

  std::string_view text_;
  std::size_t at_ = 2;  // behind the magic number
};

tl::unexpected<Error> pgm_broken(const std::string& name, std::string what, std::string expected) {
  return fail({.code = Errc::parse,
               .where = name,
               .what = std::move(what),
               .expected = std::move(expected)});
}

Status read_plain_map(const std::string& name, GreyMapTokens& words, std::size_t most, Image& out) {
  for (double& value : out.data()) {
    const auto number = words.number();
    if (!number || *number > most)
      return pgm_broken(name, "a taxel is missing or too large", "0 to " + std::to_string(most));
    value = static_cast<double>(*number);
  }
  if (!words.is_ended())
    return pgm_broken(name, "nothing ends the last taxel: the file may be cut short",
                      "a line break at the end");
  if (!words.is_at_end())
    return pgm_broken(name, "more taxels than the header says",
                      std::to_string(out.rows()) + " x " + std::to_string(out.cols()));
  return {};
}

Status read_binary_map(const std::string& name, std::string_view bytes, std::size_t most,
                       Image& out) {
  const std::size_t width = most < 256 ? 1 : 2;
  if (bytes.size() != width * out.data().size())
    return fail({.code = Errc::parse,
                 .where = name,
                 .what = "the image has another number of bytes",
                 .expected = std::to_string(width * out.data().size()),
                 .got = std::to_string(bytes.size())});
  for (std::size_t i = 0; i < out.data().size(); ++i) {
    std::size_t value = static_cast<unsigned char>(bytes[width * i]);
    if (width == 2) value = 256 * value + static_cast<unsigned char>(bytes[2 * i + 1]);
    if (value > most)
      return pgm_broken(name, "a taxel is larger than the file's largest value",
                        "0 to " + std::to_string(most));
    out.data()[i] = static_cast<double>(value);
  }
  return {};
}

}  // namespace

Result<Image> parse_image_pgm(const std::string& name, std::string_view text) {
  const bool plain = text.starts_with("P2"), binary = text.starts_with("P5");
  if (!plain && !binary) return pgm_broken(name, "no grey map", "a file that begins with P2 or P5");
  GreyMapTokens words(text);
  const auto cols = words.number(), rows = words.number(), most = words.number();
  if (!cols || !rows || !most || *most < 1 || *most > largest_map_value)
    return pgm_broken(name, "the header is not one of a grey map",
                      "width, height and a largest value of 1 to 65535");
  if (*rows == 0 || *cols == 0 || *rows > classifier::imprint::most_taxels / *cols ||
      *rows * *cols > text.size())
    return pgm_broken(name, "the image cannot have this size",
                      "as many taxels as the file has bytes");
  Image out(*rows, *cols);
  auto done = plain ? read_plain_map(name, words, *most, out)
                    : read_binary_map(name, words.rest(), *most, out);
  if (!done) return pass(done.error());
  return out;
}

}  // namespace weft::daemon
