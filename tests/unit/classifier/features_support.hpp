#pragma once
// Trials and look-ups shared by the tests of the features.

#include <algorithm>
#include <catch2/catch.hpp>
#include <string>
#include <utility>
#include <vector>

#include "classifier/features/feature_matrix.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::testing {

/// The feature called `name` of a trial.
inline double feature(const Trial& trial, const std::string& name,
                      const FeatureOptions& options = {}) {
  const auto values = extract(trial, options);
  REQUIRE(values);
  const auto names = FeatureLayout(trial.taxels, phases_of(trial)).names();
  const auto at = std::find(names.begin(), names.end(), name);
  REQUIRE(at != names.end());
  return (*values)[static_cast<std::size_t>(at - names.begin())];
}

/// Standard normal samples.
inline std::vector<double> noise(std::size_t n, std::uint64_t seed) {
  RandomEngine engine(seed);
  std::vector<double> out;
  for (std::size_t i = 0; i < n; ++i) out.push_back(normal(engine));
  return out;
}

/// Counts like those of a stroke: levels, ripple and noise that differ between taxels, flat tops.
inline Trial slide(std::size_t taxels, std::size_t motion, std::uint64_t seed) {
  RandomEngine engine(seed);
  Trial out;
  out.file = "slide";
  out.taxels = taxels;
  for (const auto& [phase, samples] :
       {std::pair(Phase::none, std::size_t{3}), std::pair(Phase::rest, std::size_t{9}),
        std::pair(Phase::press, std::size_t{7}), std::pair(Phase::motion, motion),
        std::pair(Phase::end, std::size_t{5})}) {
    for (std::size_t i = 0; i < samples; ++i) {
      out.phase.push_back(phase);
      for (std::size_t k = 0; k < taxels; ++k) {
        const double ripple = 60.0 * std::sin(static_cast<double>(i * (k + 3)) * 0.11);
        out.counts.push_back(std::nearbyint(1000.0 + 37.0 * static_cast<double>(k) + ripple +
                                            static_cast<double>(random_below(engine, 12))));
      }
    }
  }
  return out;
}

}  // namespace weft::classifier::testing
