#pragma once
// Stops that change nothing, said again and again: each counts, and a flood of them does not fill
// the journal.

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace weft::daemon::runs {

class RepeatedStops {
 public:
  using Clock = std::chrono::nanoseconds;  ///< monotonic, any origin
  /// So long repeats are counted before a line tells of them.
  static constexpr std::chrono::seconds window{10};
  /// Kinds of repeats that are told apart; more are counted together, as "auto:several".
  static constexpr std::size_t most_apart = 16;

  struct Stop {
    std::string kind, by, reason;
    bool operator==(const Stop&) const = default;
  };
  struct Counted {
    Stop stop;
    std::uint64_t times = 0;
  };

  /// Whether this one has a line of its own: it is news, or was not said within the window. Others
  /// are counted.
  bool is_journalled(const Stop& stop, bool is_news, Clock now);
  /// What was counted, where the window is over; each once.
  std::vector<Counted> over(Clock now);
  /// All that was counted, whenever.
  std::vector<Counted> all();

 private:
  struct Entry {
    Stop stop;
    Clock since{};
    std::uint64_t times = 0;
  };
  std::vector<Counted> taken(const std::function<bool(const Entry&)>& is_over);

  std::vector<Entry> entries_;
};

}  // namespace weft::daemon::runs
