#pragma once
// Which features of an imprint are taken: the paper's at any scales, Laws' energies, or both.

#include <optional>
#include <string>
#include <vector>

#include "classifier/imprint/image.hpp"
#include "classifier/imprint/scale_features.hpp"

namespace weft::classifier::imprint {

// Texture energy after Laws 1979, which Ellis 1986 (section 3.4.6) compares with.

enum class LawsSize {
  three,  ///< 3 x 3: products of L3 1 2 1, E3 -1 0 1, S3 -1 2 -1
  five  ///< 5 x 5: of L5 1 4 6 4 1, E5 -1 -2 0 2 1, S5 -1 0 2 0 -1, W5 -1 2 0 -2 1, R5 1 -4 6 -4 1
};

/// "laws.L3E3" is L3 down the columns and E3 along the rows. All products but the level L x L,
/// which is no texture: 8 or 24.
std::vector<std::string> laws_names(LawsSize size);

/// Mean absolute value in counts of the image convolved with each mask, where the mask lies inside;
/// 0 where it lies nowhere inside. Refuses what check(image) refuses.
Result<std::vector<double>> laws_energy(const Image& image, LawsSize size);

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
