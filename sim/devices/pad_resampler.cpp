#include "sim/devices/pad_resampler.hpp"

#include <algorithm>
#include <cmath>

#include "sim/plant/random.hpp"

namespace weft::sim {
namespace {

constexpr std::size_t pads_across = 4;
static_assert(pads_across * pads_across == pad_count);

}  // namespace

std::vector<TaxelPlace> taxel_grid(std::size_t rows, std::size_t cols) {
  constexpr double wide_m = pads_across * pad_pitch_m;
  const auto along = [&](std::size_t i, std::size_t of) {
    return ((static_cast<double>(i) + 0.5) / static_cast<double>(of) - 0.5) * wide_m;
  };
  std::vector<TaxelPlace> places;
  for (std::size_t row = 0; row < rows; ++row)
    for (std::size_t col = 0; col < cols; ++col)
      places.push_back({along(col, cols), along(row, rows)});
  return places;
}

PadResampler::PadResampler(const std::vector<TaxelPlace>& places, double noise_counts,
                           std::uint64_t seed)
    : noise_counts_(noise_counts), seed_(seed) {
  for (const TaxelPlace& place : places) mixes_.push_back(mix_at(place));
}

/// Beyond the outer pads the nearest pads are used.
PadResampler::Mix PadResampler::mix_at(const TaxelPlace& place) {
  const auto cell = [](double at_m, double first_m) {
    const double at = std::clamp((at_m - first_m) / pad_pitch_m, 0.0, double{pads_across - 1});
    const auto low = std::min(static_cast<std::size_t>(at), pads_across - 2);
    return std::pair{low, at - static_cast<double>(low)};
  };
  const auto [col, right] = cell(place.x_m, pad_dx_m(0));
  const auto [row, up] = cell(place.y_m, pad_dy_m(0));
  const std::size_t first = row * pads_across + col;
  return {{first, first + 1, first + pads_across, first + pads_across + 1},
          {(1 - right) * (1 - up), right * (1 - up), (1 - right) * up, right * up}};
}

void PadResampler::sample(const PadFrame& newest, TimePoint at, std::uint64_t frame,
                          std::span<std::uint16_t> counts) {
  if (!begun_ || newest.index != newest_.index) {
    before_ = begun_ ? newest_ : newest;
    newest_ = newest;
    begun_ = true;
  }
  const Duration since = at - BenchPlant::frame_start(newest.index + 1);
  const double late = std::clamp(
      static_cast<double>(since.count()) / static_cast<double>(pad_timing::frame_ns), 0.0, 1.0);
  Random dice(mix(seed_, frame));
  for (std::size_t i = 0; i < counts.size(); ++i) {
    double level = 0;
    for (std::size_t k = 0; k < mixes_[i].pad.size(); ++k) {
      const std::size_t pad = mixes_[i].pad[k];
      level += mixes_[i].share[k] * ((1 - late) * before_.counts[pad] + late * newest_.counts[pad]);
    }
    counts[i] = quantise(level + noise_counts_ * dice.gaussian());
  }
}

}  // namespace weft::sim
