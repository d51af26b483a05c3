#pragma once
// Joins several tactile arrays of a rig into one: recorder, classifier and page use one frame.

#include <cstdint>
#include <vector>

#include "drivers/api/sample.hpp"

namespace weft::daemon {

/// The joined frame has the taxels of the rig's first array, then those of the second and so on. It
/// is made when the first array sends, with the newest counts of the others. These are up to one of
/// their periods old, or older after lost frames. Thread-bound to its owner.
class JoinedTaxels {
 public:
  /// Returns the number of the new array, from 0.
  std::size_t add_array();
  /// Stores the newest frame of one array.
  void take(std::size_t array, const TaxelSample& frame);
  /// Whether every array has sent a frame.
  [[nodiscard]] bool is_complete() const;
  /// [counts] of all arrays; valid until the next take(). Requires is_complete().
  std::span<const std::uint16_t> counts();
  /// `first`, the first array's newest sample, with counts(). Its number, time and lost frames are
  /// those of the first array.
  Sample joined(const Sample& first);

 private:
  std::vector<std::vector<std::uint16_t>> arrays_;
  std::vector<std::uint16_t> counts_;
};

}  // namespace weft::daemon
