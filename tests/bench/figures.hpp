#pragma once
// What a benchmark prints and writes: a table on the terminal and out/bench/NAME.json.

#include <cstddef>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace weft::bench {

/// One line. `peer_value` is what the peer, or the limit that physics or the brief sets, gave in
/// the same run; `ratio` is value / peer_value.
struct Figure {
  std::string figure;
  double value = 0;
  std::string unit;
  std::string peer;
  double peer_value = 0;
  std::string note;
};

/// Median of an odd number of runs; the list is sorted.
double median(std::vector<double>& values);

/// Wall time of one call.
double seconds_of(const std::function<void()>& work);
/// Median of `count` calls after one that warms caches and tables.
double median_of(std::size_t count, const std::function<void()>& work);

/// The JSON that a command prints; discarded() where it prints none, or where its program or what
/// that needs is absent.
nlohmann::json json_of(const std::string& command);

/// Prints the table, writes the file, returns the exit status.
int report(const std::string& name, const std::vector<Figure>& figures);

}  // namespace weft::bench
