#include "classifier/vibro/bin_tables.hpp"

#include <algorithm>
#include <cmath>

namespace weft::classifier::vibro {
namespace {

constexpr double least_share = 1e-13;  // relative to the weight of the nearest class

// A bin's weights, class by class.
using Row = std::array<double, pitch_classes>;

// The largest weight of a class outside the near ones that begin at `first`.
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

constexpr double concert_pitch_hz = 440.0;
constexpr double centre_octave = 5.0, octave_width = 2.0;  // librosa: ctroct, octwidth
constexpr std::size_t classes_from_a_to_c = 3;             // pitches are counted from A

// Pitch of every bin of the whole transform, in classes above the A of 27.5 Hz.
std::vector<double> pitches(double rate_hz, std::size_t length) {
  const auto classes = static_cast<double>(pitch_classes);
  std::vector<double> out(length);
  for (std::size_t k = 1; k < length; ++k)
    out[k] = classes * std::log2(rate_hz * static_cast<double>(k) / static_cast<double>(length) /
                                 (concert_pitch_hz / 16.0));
  out[0] = out[1] - 1.5 * classes;
  return out;
}

double squared(double v) {
  return v * v;
}

// Distance around the circle of classes, -6 to 6.
double circular_distance(double pitch, std::size_t to) {
  const auto classes = static_cast<double>(pitch_classes);
  const double half = classes / 2.0;
  const double turned = pitch - static_cast<double>(to) + half + 10.0 * classes;
  return turned - classes * std::floor(turned / classes) - half;
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

std::vector<double> chroma_weights(double rate_hz, std::size_t length) {
  const std::size_t bins = length / 2 + 1;
  const std::vector<double> pitch = pitches(rate_hz, length);
  std::vector<double> out(pitch_classes * bins);
  for (std::size_t k = 0; k < bins; ++k) {
    const double width = k + 1 < length ? std::max(pitch[k + 1] - pitch[k], 1.0) : 1.0;
    double weight[pitch_classes], norm = 0.0;
    for (std::size_t c = 0; c < pitch_classes; ++c) {
      weight[c] = std::exp(-0.5 * squared(2.0 * circular_distance(pitch[k], c) / width));
      norm += squared(weight[c]);
    }
    const double octave = pitch[k] / static_cast<double>(pitch_classes);
    const double hill = std::exp(-0.5 * squared((octave - centre_octave) / octave_width));
    for (std::size_t c = 0; c < pitch_classes; ++c) {
      const std::size_t row = (c + pitch_classes - classes_from_a_to_c) % pitch_classes;
      out[row * bins + k] = weight[c] / std::max(std::sqrt(norm), 1e-30) * hill;
    }
  }
  return out;
}

std::vector<double> a_weighting_db(double rate_hz, std::size_t length) {
  constexpr double least_db = -80.0;
  const double high = squared(12194.217), low = squared(20.598997), first = squared(107.65265),
               second = squared(737.86223);
  std::vector<double> out;
  for (std::size_t k = 0; k <= length / 2; ++k) {
    const double f2 = squared(rate_hz * static_cast<double>(k) / static_cast<double>(length));
    const double db = 2.0 + 20.0 * (std::log10(high) + 2.0 * std::log10(f2) -
                                    std::log10(f2 + high) - std::log10(f2 + low) -
                                    0.5 * std::log10(f2 + first) - 0.5 * std::log10(f2 + second));
    out.push_back(std::max(db, least_db));
  }
  return out;
}

}  // namespace weft::classifier::vibro
