#include "daemon/hardware/rig/joined_taxels.hpp"

#include <algorithm>

namespace weft::daemon {

std::size_t JoinedTaxels::add_array() {
  arrays_.emplace_back();
  return arrays_.size() - 1;
}

void JoinedTaxels::take(std::size_t array, const TaxelSample& frame) {
  arrays_[array].assign(frame.counts.begin(), frame.counts.end());
}

bool JoinedTaxels::is_complete() const {
  return std::ranges::none_of(arrays_, [](const auto& array) { return array.empty(); });
}

std::span<const std::uint16_t> JoinedTaxels::counts() {
  counts_.clear();
  for (const auto& array : arrays_) counts_.insert(counts_.end(), array.begin(), array.end());
  return counts_;
}

Sample JoinedTaxels::joined(const Sample& first) {
  Sample out = first;
  std::get<TaxelSample>(out.value).counts = counts();
  return out;
}

}  // namespace weft::daemon
