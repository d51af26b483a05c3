#pragma once
// The mean of a few records of the stream.

#include "protocols/ati_digital/stream.hpp"

namespace weft::drivers {

/// Adds records up until there are enough for a sample.
class WrenchMean {
 public:
  void add(const protocols::ati_digital::StreamRecord& record, std::uint32_t lost) {
    for (std::size_t g = 0; g < sums_.size(); ++g) {
      const std::int16_t counts = record.gauge_counts[g];
      sums_[g] += counts;
      saturated_ = saturated_ || counts >= rail || counts <= -rail;
    }
    status_error_ = status_error_ || record.status_error;
    lost_ += lost;
    ++count_;
  }
  [[nodiscard]] std::uint32_t count() const { return count_; }
  [[nodiscard]] bool saturated() const { return saturated_; }
  [[nodiscard]] bool status_error() const { return status_error_; }
  [[nodiscard]] std::array<double, protocols::ati_digital::gauges> counts() const {
    std::array<double, protocols::ati_digital::gauges> mean{};
    for (std::size_t g = 0; g < mean.size(); ++g)
      mean[g] = static_cast<double>(sums_[g]) / static_cast<double>(count_);
    return mean;
  }
  /// Samples that the lost records would have made; what is left over counts for the next.
  std::uint32_t begin_next(std::uint32_t records_per_sample) {
    const std::uint32_t samples = lost_ / records_per_sample;
    const std::uint32_t left = lost_ % records_per_sample;
    *this = {};
    lost_ = left;
    return samples;
  }

 private:
  /// The ends of the converter: the gauge may be anywhere beyond.
  static constexpr std::int16_t rail = 32767;
  std::array<std::int64_t, protocols::ati_digital::gauges> sums_{};
  std::uint32_t count_ = 0;
  std::uint32_t lost_ = 0;
  bool saturated_ = false;
  bool status_error_ = false;
};

}  // namespace weft::drivers
