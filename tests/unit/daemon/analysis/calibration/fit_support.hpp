#pragma once
// Short strokes for simulation by the plant, and the shipped table of fabrics.

#include <catch2/catch.hpp>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "daemon/analysis/calibration/calibrate.hpp"
#include "daemon/analysis/calibration/minimise.hpp"

namespace weft::daemon::calibration::test {

constexpr double recorded_level = 300;  // counts: half of what a pad of the plant can read

/// Ends a test of the search, with a message, if Weft was built without NLopt.
inline bool lacks_nlopt() {
  if (!has_nlopt()) WARN("built without NLopt: nothing is searched");
  return !has_nlopt();
}

inline std::string table_text() {
  std::ifstream in(std::string(WEFT_SOURCE_DIR) + "/sim/fabrics.json");
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

inline sim::FabricLibrary table() {
  auto library = sim::parse_fabrics(table_text());
  REQUIRE(library);
  return std::move(*library);
}

inline double mean_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

/// 25 mm at 10 mm/s, without counts: a cell for each mounting of each fabric.
inline RecordingView empty_strokes(const std::vector<std::string>& cloths, std::uint32_t mountings,
                                   std::uint32_t repetitions = 1, std::size_t channels = 16) {
  constexpr std::size_t samples = 92;
  RecordingView out;
  out.channels = out.recorded_channels = channels;
  for (std::size_t c = 0; c < channels; ++c) out.recorded.push_back(c);
  for (const std::string& cloth : cloths)
    for (std::uint32_t mounting = 1; mounting <= mountings; ++mounting)
      for (std::uint32_t repetition = 0; repetition < repetitions; ++repetition) {
        Stroke stroke;
        stroke.cloth = cloth;
        stroke.cell = cloth + std::to_string(mounting);
        stroke.repetition = repetition;
        stroke.mounting = mounting;
        stroke.speed_mps = 0.01;
        stroke.rate_hz = 37;
        stroke.counts.assign(channels, std::vector<double>(samples, recorded_level));
        stroke.level.assign(channels, recorded_level);
        out.strokes.push_back(std::move(stroke));
      }
  return out;
}

/// The estimates as a result; each block has another state.
inline CalibrationResult result_of(const ClothModel& model) {
  CalibrationResult out;
  out.cloths = model.cloths();
  for (const Parameter& p : model.parameters()) {
    const Standing standing = p.block == Block::cloth       ? Standing::calibrated
                              : p.block == Block::common    ? Standing::bounded
                              : p.block == Block::estimator ? Standing::not_seen
                                                            : Standing::estimated;
    out.parameters.push_back({p, standing, p.start, 0.9 * p.start, 1.1 * p.start});
  }
  return out;
}

}  // namespace weft::daemon::calibration::test
