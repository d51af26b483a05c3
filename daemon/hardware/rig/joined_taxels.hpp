#pragma once
// Several tactile arrays on one rig as one: recorder, classifier and page know one frame.

#include <cstdint>
#include <vector>

#include "drivers/api/sample.hpp"

namespace weft::daemon {

/// The joined frame has the taxels of the rig's first array, then those of the second and so on. It
/// comes when the first array sends, with the newest counts of the others: up to one of their
/// periods old, and older where they lost frames. Thread-bound to its owner.
class JoinedTaxels {
 public:
  /// Returns the number of the new array, from 0.
  std::size_t add_array();
  /// The newest frame of one array.
  void take(std::size_t array, const TaxelSample& frame);
  /// Whether every array has sent a frame.
  [[nodiscard]] bool is_complete() const;
  /// [counts] of all arrays; valid until the next take(). is_complete() must hold.
  std::span<const std::uint16_t> counts();
  /// `first`, the first array's newest sample, with counts(): its number, time and lost frames are
  /// the first array's.
  Sample joined(const Sample& first);

 private:
  std::vector<std::vector<std::uint16_t>> arrays_;
  std::vector<std::uint16_t> counts_;
};

}  // namespace weft::daemon
