#pragma once
// Output of a benchmark: a table on the terminal and out/bench/NAME.json.

#include <cstddef>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

namespace weft::bench {

/// The aim for a figure. A benchmark reports a missed limit but does not fail.
struct Limit {
  enum class Of { value, ratio } of = Of::value;  ///< limits the figure, or its ratio to the peer
  enum class Direction { at_most, at_least } direction = Direction::at_most;
  double bound = 0;
};
constexpr Limit at_most(double bound) {
  return {Limit::Of::value, Limit::Direction::at_most, bound};
}
constexpr Limit at_least(double bound) {
  return {Limit::Of::value, Limit::Direction::at_least, bound};
}
/// "At least `times` faster than the peer", for a figure that is a time.
constexpr Limit faster_by(double times) {
  return {Limit::Of::ratio, Limit::Direction::at_most, 1.0 / times};
}
constexpr Limit ratio_at_most(double bound) {
  return {Limit::Of::ratio, Limit::Direction::at_most, bound};
}

/// One line of the table. `peer_value` comes from the peer in the same run, or from a limit of
/// physics or of a requirement. `ratio` is value / peer_value.
struct Figure {
  std::string figure;
  double value = 0;
  std::string unit;
  std::string peer;
  double peer_value = 0;
  std::string note;
  std::optional<Limit> limit = {};
};

/// True if the figure has a limit and is not within it; NaN is a miss.
bool missed(const Figure& figure);
/// "at most 20 us", "ratio at most 0.05"; empty without a limit.
std::string format_limit(const Figure& figure);

/// Processor time of this process [s], all threads: other work of the machine does not count.
double processor_seconds();

/// Median of an odd number of runs. Sorts the list.
double median(std::vector<double>& values);

/// Wall time of one call [s].
double seconds_of(const std::function<void()>& work);
/// Median [s] of `count` calls, after one that warms caches and tables.
double compute_median(std::size_t count, const std::function<void()>& work);

/// The JSON output of a command; discarded() if there is none, for example if the program is
/// absent.
nlohmann::json json_of(const std::string& command);

/// Prints the machine, the table and the missed limits, and writes the file. Returns the exit
/// status: 1 without figures or if the file cannot be written, never for a missed limit.
int report(const std::string& name, const std::vector<Figure>& figures);

}  // namespace weft::bench
