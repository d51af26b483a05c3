#pragma once
// What a benchmark prints and writes: a table on the terminal and out/bench/NAME.json.

#include <cstddef>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

namespace weft::bench {

/// What a figure is asked to reach. A benchmark reports what is missed; it does not fail by it.
struct Limit {
  enum class Of { value, ratio } of = Of::value;  ///< of the figure, or of it over its peer
  enum class Direction { at_most, at_least } direction = Direction::at_most;
  double bound = 0;
};
constexpr Limit at_most(double bound) {
  return {Limit::Of::value, Limit::Direction::at_most, bound};
}
constexpr Limit at_least(double bound) {
  return {Limit::Of::value, Limit::Direction::at_least, bound};
}
/// "At least `times` faster than the peer", where the figure is a time.
constexpr Limit faster_by(double times) {
  return {Limit::Of::ratio, Limit::Direction::at_most, 1.0 / times};
}
constexpr Limit ratio_at_most(double bound) {
  return {Limit::Of::ratio, Limit::Direction::at_most, bound};
}

/// One line. `peer_value` is what the peer, or the limit that physics or a requirement sets, gave
/// in the same run; `ratio` is value / peer_value.
struct Figure {
  std::string figure;
  double value = 0;
  std::string unit;
  std::string peer;
  double peer_value = 0;
  std::string note;
  std::optional<Limit> limit = {};
};

/// Whether it has a limit and is not within it; what is not a number is not.
bool missed(const Figure& figure);
/// "at most 20 us", "ratio at most 0.05"; empty without a limit.
std::string format_limit(const Figure& figure);

/// Processor time of this process, all threads: what else the machine does costs nothing.
double processor_seconds();

/// Median of an odd number of runs; the list is sorted.
double median(std::vector<double>& values);

/// Wall time of one call.
double seconds_of(const std::function<void()>& work);
/// Median of `count` calls after one that warms caches and tables.
double compute_median(std::size_t count, const std::function<void()>& work);

/// The JSON that a command prints; discarded() where it prints none, or where its program or what
/// that needs is absent.
nlohmann::json json_of(const std::string& command);

/// Prints the machine, the table and what missed its limit, writes the file, returns the exit
/// status: 1 where there is no figure or the file could not be written, never for a miss.
int report(const std::string& name, const std::vector<Figure>& figures);

}  // namespace weft::bench
