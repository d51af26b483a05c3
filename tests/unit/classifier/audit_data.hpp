#pragma once
// Made-up campaigns for the audit: labels carried by a real feature, and a column that depends on
// them or not. SIMULATED numbers; nothing here comes from a plant.

#include <string>
#include <string_view>
#include <vector>

#include "classifier/base/random.hpp"
#include "classifier/evaluate/audit.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::testing {

struct MadeUpCampaign {
  FeatureMatrix full;
  std::vector<Probe> probes;
};

struct Planted {
  std::string_view probe;  ///< "" for a clean campaign
  double effect = 3.0;     ///< distance of the labels' means in deviations of the probe
  double material = 1.0;   ///< distance of the labels' means in the features of the material
};

constexpr std::size_t made_up_labels = 4;
constexpr std::size_t made_up_groups = 6;
constexpr std::size_t made_up_repeats = 2;  ///< of each label in each group

/// `columns` of noise, shared by a group and of each trial, plus `effect` times the label's corner
/// of a cube: the difference between labels.
inline Probe noise_probe(const FeatureMatrix& rows, std::string name, std::size_t columns,
                         double effect, RandomEngine& engine) {
  Probe out{std::move(name), rows};
  out.features.names.clear();
  out.features.values = Matrix(rows.size(), columns);
  for (std::size_t c = 0; c < columns; ++c) {
    out.features.names.push_back(out.name + std::to_string(c));
    std::vector<double> of_group;
    for (std::size_t g = 0; g < made_up_groups; ++g) of_group.push_back(normal(engine));
    for (std::size_t r = 0; r < rows.size(); ++r) {
      const auto label = static_cast<std::size_t>(rows.labels[r].back() - 'a');
      const bool high = ((label >> (c % 2)) & 1U) != 0;
      out.features.values(r, c) =
          0.5 * of_group[r % made_up_groups] + normal(engine) + (high ? effect : 0.0);
    }
  }
  return out;
}

/// Four labels in each of six groups, twice: 48 trials. The full features have the material's
/// effect and, like real ones, that of the planted probe.
inline MadeUpCampaign made_up_campaign(std::uint64_t seed, const Planted& planted) {
  RandomEngine engine(seed);
  MadeUpCampaign out;
  const std::size_t rows = made_up_labels * made_up_groups * made_up_repeats;
  for (std::size_t r = 0; r < rows; ++r) {
    out.full.labels.push_back(
        std::string("cloth ").append(1, static_cast<char>('a' + r / (rows / made_up_labels))));
    out.full.groups.push_back(std::to_string(r % made_up_groups));
    out.full.files.push_back(std::to_string(r) + ".csv");
  }
  out.full.values = Matrix(rows, 0);
  for (const std::string_view name : {"pad pattern", "durations", "order and time", "phase S"})
    out.probes.push_back(noise_probe(out.full, std::string(name), name == "pad pattern" ? 16 : 3,
                                     name == planted.probe ? planted.effect : 0.0, engine));
  FeatureMatrix material = noise_probe(out.full, "material", 24, planted.material, engine).features;
  for (const Probe& probe : out.probes)
    if (probe.name == planted.probe) append_columns(probe.features, "", material);
  out.full = std::move(material);
  return out;
}

}  // namespace weft::classifier::testing
