#pragma once
// Which features of an imprint are taken: the paper's at any scales, Laws' energies, or both.

#include <optional>
#include <string>
#include <vector>

#include "classifier/imprint/laws.hpp"
#include "classifier/imprint/scale_features.hpp"

namespace weft::classifier::imprint {

/// By default what told classes apart best on the training parts of what there is to learn from
/// (daemon/storage/imprints/README.md): more than the paper's scales 1, 2 and 4 alone.
struct FeaturePlan {
  /// Ellis 1986; empty: none of them.
  std::optional<ScaleOptions> scales = ScaleOptions{.sigmas = {0.0, 1.0, 2.0, 3.0, 4.0}};
  /// Laws 1979, on the imprint as it is.
  std::vector<LawsSize> laws = {LawsSize::five};
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
