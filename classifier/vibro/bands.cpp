#include "classifier/vibro/bands.hpp"

#include <algorithm>
#include <cmath>

#include "classifier/vibro/bin_tables.hpp"
#include "classifier/vibro/short_time.hpp"

namespace weft::classifier::vibro {
namespace {

constexpr std::size_t first_bin = 2;  // below is the level, spread by the window
constexpr double least_band_power = 1e-10;

}  // namespace

std::array<std::size_t, band_count + 1> band_edges(std::size_t bins) {
  std::array<std::size_t, band_count + 1> out{};
  const double octaves = std::log2(std::max(static_cast<double>(bins) / first_bin, 1.0));
  for (std::size_t b = 0; b < out.size(); ++b) {
    const double share = static_cast<double>(b) / static_cast<double>(band_count);
    const auto edge = static_cast<std::size_t>(
        std::llround(static_cast<double>(first_bin) * std::exp2(octaves * share)));
    out[b] = b == 0 ? std::min(edge, bins) : std::min(std::max(edge, out[b - 1] + 1), bins);
  }
  return out;
}

void BandSums::add(const double* magnitudes, std::size_t frames) {
  constexpr std::size_t lanes = ShortTimeSpectrum::lanes;
  for (std::size_t b = 0; b < band_count; ++b) {
    PerFrame power{};
    for (std::size_t k = edges_[b]; k < edges_[b + 1]; ++k)
      for (std::size_t f = 0; f < lanes; ++f)
        power[f] += magnitudes[k * lanes + f] * magnitudes[k * lanes + f];
    for (std::size_t f = 0; f < std::min(frames, lanes); ++f)
      level_db_[b].push_back(10.0 * std::log10(std::max(power[f], least_band_power)));
  }
}

BandFeatures BandSums::figures() const {
  BandFeatures out{};
  for (std::size_t b = 0; b < band_count; ++b) {
    const auto n = static_cast<double>(level_db_[b].size());
    double mean = 0.0, squares = 0.0;
    for (const double level : level_db_[b]) mean += level / n;
    for (const double level : level_db_[b]) squares += (level - mean) * (level - mean);
    out[b] = mean;
    out[band_count + b] = std::sqrt(squares / n);
  }
  return out;
}

}  // namespace weft::classifier::vibro
