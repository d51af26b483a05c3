#include "daemon/hardware/rig/joined_taxels.hpp"

#include <algorithm>

namespace weft::daemon {

std::size_t JoinedTaxels::add_array() {
  arrays_.emplace_back();
  return arrays_.size() - 1;
}

void JoinedTaxels::take(std::size_t array, const TaxelSample& frame, std::uint32_t lost) {
  arrays_[array].counts.assign(frame.counts.begin(), frame.counts.end());
  arrays_[array].lost += lost;
}

bool JoinedTaxels::is_complete() const {
  return std::ranges::none_of(arrays_, [](const Array& array) { return array.counts.empty(); });
}

std::span<const std::uint16_t> JoinedTaxels::counts() {
  counts_.clear();
  for (const Array& array : arrays_)
    counts_.insert(counts_.end(), array.counts.begin(), array.counts.end());
  return counts_;
}

Sample JoinedTaxels::joined(const Sample& first) {
  Sample out = first;
  out.lost = 0;
  for (Array& array : arrays_) out.lost += std::exchange(array.lost, 0);
  std::get<TaxelSample>(out.value).counts = counts();
  return out;
}

}  // namespace weft::daemon
