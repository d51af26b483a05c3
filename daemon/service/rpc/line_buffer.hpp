#pragma once
// Bytes to lines, bounded: what is longer than a line may be ends the connection.

#include <optional>
#include <string>
#include <string_view>

namespace weft::daemon::server {

class LineBuffer {
 public:
  explicit LineBuffer(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  void add(std::string_view bytes) { held_.append(bytes); }
  /// The next whole line without its end ("\n" or "\r\n").
  std::optional<std::string> next() {
    const std::size_t end = held_.find('\n', searched_);
    if (end == std::string::npos) {
      searched_ = held_.size();
      return std::nullopt;
    }
    std::string line = held_.substr(0, end);
    held_.erase(0, end + 1);
    searched_ = 0;
    if (line.ends_with('\r')) line.pop_back();
    return line;
  }
  /// What came after the last whole line, once next() has none.
  [[nodiscard]] std::string_view rest() const { return held_; }
  /// What is held is more than one line may be.
  [[nodiscard]] bool overflows() const { return held_.size() > most_bytes_; }

 private:
  std::string held_;
  std::size_t searched_ = 0;  // no line end before here
  std::size_t most_bytes_;
};

}  // namespace weft::daemon::server
