#pragma once
// Which features of an imprint are taken: the paper's at any scales, Laws' energies, or both.

#include <optional>
#include <string>
#include <vector>

#include "classifier/imprint/laws.hpp"
#include "classifier/imprint/scale_features.hpp"

namespace weft::classifier::imprint {

struct FeaturePlan {
  std::optional<ScaleOptions> scales = ScaleOptions{};  ///< Ellis 1986; empty: none of them
  std::vector<LawsSize> laws = {};                      ///< Laws 1979, on the imprint as it is
};

/// Keeps its scratch memory: one object per thread.
class PlannedFeatures {
 public:
  /// Refuses what ScaleFeatures refuses, no feature at all, and a size of Laws' masks twice.
  static Result<PlannedFeatures> make(const FeaturePlan& plan);

  /// Those of the scales first, then those of each size of Laws' masks in turn.
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  /// [names().size()], all finite. Refuses what check(image) refuses.
  Result<std::vector<double>> extract(const Image& image);

 private:
  std::optional<ScaleFeatures> scales_;
  std::vector<LawsSize> laws_;
  std::vector<std::string> names_;
};

}  // namespace weft::classifier::imprint
