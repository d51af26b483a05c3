#pragma once
// What a benchmark prints and writes: a table on the terminal and out/bench/NAME.json.

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

/// Prints the table, writes the file, returns the exit status.
int report(const std::string& name, const std::vector<Figure>& figures);

}  // namespace weft::bench
