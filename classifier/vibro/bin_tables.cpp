#include "classifier/vibro/bin_tables.hpp"

#include <algorithm>

#include "classifier/vibro/filters.hpp"

namespace weft::classifier::vibro {
namespace {

constexpr double least_share = 1e-13;  // of the weight of the nearest class

// A bin's weights, class by class.
using Row = std::array<double, pitch_classes>;

// The largest weight of a class that is not among the near ones from `first` on.
double outside(const Row& row, std::size_t first) {
  double out = 0.0;
  for (std::size_t i = near_classes; i < pitch_classes; ++i)
    out = std::max(out, row[(first + i) % pitch_classes]);
  return out;
}

std::size_t first_near(const Row& row) {
  std::size_t best = 0;
  for (std::size_t first = 1; first < pitch_classes; ++first)
    if (outside(row, first) < outside(row, best)) best = first;
  return best;
}

}  // namespace

BinTables::BinTables(double rate_hz, std::size_t length) : bins(length / 2 + 1) {
  for (std::size_t k = 0; k < bins; ++k)
    frequency_hz.push_back(rate_hz * static_cast<double>(k) / static_cast<double>(length));
  const std::vector<double> weights = chroma_weights(rate_hz, length);
  std::vector<Row> rows(bins);
  for (std::size_t k = 0; k < bins; ++k) {
    for (std::size_t c = 0; c < pitch_classes; ++c) rows[k][c] = weights[c * bins + k];
    if (outside(rows[k], first_near(rows[k])) > least_share * *std::ranges::max_element(rows[k]))
      wide_bins = k + 1;
  }
  for (std::size_t k = 0; k < wide_bins; ++k)
    wide_chroma.insert(wide_chroma.end(), rows[k].begin(), rows[k].end());
  for (std::size_t k = wide_bins; k < bins; ++k) {
    const std::size_t first = first_near(rows[k]);
    if (runs.empty() || runs.back().first_class != first) runs.push_back({k, k, first});
    runs.back().end_bin = k + 1;
    for (std::size_t i = 0; i < near_classes; ++i)
      near_chroma.push_back(rows[k][(first + i) % pitch_classes]);
  }
  for (const double db : a_weighting_db(rate_hz, length)) mean_a_weighting_db += db;
  mean_a_weighting_db /= static_cast<double>(bins);
}

}  // namespace weft::classifier::vibro
