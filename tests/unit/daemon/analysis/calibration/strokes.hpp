#pragma once
// Strokes with known statistics.

#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "daemon/analysis/calibration/recording_view.hpp"
#include "sim/plant/random.hpp"

namespace weft::daemon::calibration::test {

constexpr double rate_hz = 36;
constexpr double speed_mps = 0.009;  // 0.25 mm from sample to sample, 200 samples a window
constexpr double pitch_mm = 1e3 * speed_mps / rate_hz;

/// Counts at a sample of a channel.
using Signal = std::function<double(std::size_t channel, std::size_t sample)>;

inline Stroke stroke(std::string cloth, std::uint32_t repetition, std::size_t channels,
                     std::size_t samples, const Signal& signal, std::uint32_t mounting = 1) {
  Stroke out;
  out.cell = cloth + std::to_string(mounting);
  out.cloth = std::move(cloth);
  out.repetition = repetition;
  out.mounting = mounting;
  out.speed_mps = speed_mps;
  out.rate_hz = rate_hz;
  for (std::size_t c = 0; c < channels; ++c) {
    double sum = 0;
    for (std::size_t i = 0; i < samples; ++i) {
      if (i == 0) out.counts.emplace_back();
      out.counts[c].push_back(signal(c, i));
      sum += out.counts[c].back();
    }
    out.level.push_back(sum / static_cast<double>(samples));
  }
  return out;
}

inline RecordingView view_of(std::vector<Stroke> strokes) {
  RecordingView out;
  out.channels = out.recorded_channels = strokes.front().counts.size();
  for (std::size_t c = 0; c < out.channels; ++c) out.recorded.push_back(c);
  out.strokes = std::move(strokes);
  return out;
}

/// Standard normal number; the same arguments give the same number.
inline double draw(std::uint64_t stream, std::size_t channel, std::size_t sample) {
  return sim::Random(sim::mix(sim::mix(stream, channel), sample)).gaussian();
}

/// A wave of amplitude 1 about 0.
inline double wave(std::size_t sample, double length_mm) {
  return std::sin(2 * std::numbers::pi * static_cast<double>(sample) * pitch_mm / length_mm);
}

}  // namespace weft::daemon::calibration::test
