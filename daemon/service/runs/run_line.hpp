#pragma once
// The order in which runs wait for the rig.

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

namespace weft::daemon::control {

/// Runs by their numbers, the next first. Another revision is another line: who changes what he has
/// read says which.
struct RunLine {
  std::int64_t revision = 0;
  std::string held_by;  ///< nothing begins until somebody starts it; empty: it is not held
  std::vector<std::int64_t> runs;

  [[nodiscard]] bool held() const { return !held_by.empty(); }
  /// From 0; the length of the line for one that is not in it.
  [[nodiscard]] std::size_t place_of(std::int64_t run) const {
    return static_cast<std::size_t>(std::find(runs.begin(), runs.end(), run) - runs.begin());
  }
  /// A place past the end is the end.
  void put(std::int64_t run, std::size_t place) {
    std::erase(runs, run);
    const std::size_t at = std::min(place, runs.size());
    runs.insert(runs.begin() + static_cast<std::ptrdiff_t>(at), run);
  }
  friend bool operator==(const RunLine&, const RunLine&) = default;
};

}  // namespace weft::daemon::control
