#pragma once
// Imprints with their labels and objects, and their feature matrix.

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/features/feature_matrix.hpp"
#include "classifier/imprint/image.hpp"
#include "classifier/imprint/scale_features.hpp"

namespace weft::classifier::imprint {

// Features of an imprint: the paper's at any scales, Laws' energies, or both.

// Texture energy by Laws 1979; Ellis 1986 (section 3.4.6) compares with it.

enum class LawsSize {
  three,  ///< 3 x 3: products of L3 1 2 1, E3 -1 0 1, S3 -1 2 -1
  five    ///< 5 x 5: products of L5 1 4 6 4 1, E5 -1 -2 0 2 1, S5 -1 0 2 0 -1, W5 -1 2 0 -2 1, R5 1
          ///< -4 6 -4 1
};

/// "laws.L3E3" is L3 down the columns and E3 along the rows. All products except the level L x L,
/// which is no texture: 8 or 24.
std::vector<std::string> laws_names(LawsSize size);

/// Mean absolute value in counts of the image convolved with each mask, where the mask lies inside;
/// 0 if it lies nowhere inside. Refuses what check(image) refuses.
Result<std::vector<double>> laws_energy(const Image& image, LawsSize size);

// Maps of the contact: the pressure of an object at each part of the array, relative to the whole.

inline constexpr std::string_view map_prefix = "map";

/// "map2.r0c1": the second pool of 2 x 2 taxels of the first row. Pools are 2 x 2, 4 x 4 and 8 x 8
/// taxels, side by side from the first taxel on. Those of the last row and column may be smaller.
/// There are no pools larger than the array.
std::vector<std::string> map_names(std::size_t rows, std::size_t cols);

/// Mean count of each pool over the sum of the imprint's absolute counts, so a press twice as hard
/// has the same maps. An imprint of zeros has maps of zeros. Refuses what check(image) refuses.
Result<std::vector<double>> contact_maps(const Image& image);

/// The default separated classes best on the training parts of the available data
/// (classifier/imprint/MEASURED.md). It has more than the paper's scales 1, 2 and 4.
struct FeaturePlan {
  /// Features of Ellis 1986; empty: none.
  std::optional<ScaleOptions> scales = ScaleOptions{.sigmas = {0.0, 1.0, 2.0, 3.0, 4.0}};
  /// Features of Laws 1979, on the unsmoothed imprint.
  std::vector<LawsSize> laws = {LawsSize::five};
  bool maps = false;  ///< contact_maps(), on the unsmoothed imprint
};

/// Extracts the features of a plan. Keeps its scratch memory; one object per thread.
class PlannedFeatures {
 public:
  /// For imprints of `rows` x `cols`. Refuses what ScaleFeatures refuses, no feature at all, and a
  /// repeated size of Laws' masks.
  static Result<PlannedFeatures> make(const FeaturePlan& plan, std::size_t rows, std::size_t cols);

  /// Features of the scales first, then of each size of Laws' masks, then of the maps.
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  /// [names().size()], all finite. Refuses what check(image) refuses, and with maps an imprint of
  /// another size.
  Result<std::vector<double>> extract(const Image& image);

 private:
  std::optional<ScaleFeatures> scales_;
  std::vector<LawsSize> laws_;
  bool maps_ = false;
  std::size_t rows_ = 0, cols_ = 0;
  std::vector<std::string> names_;
};

struct Imprint {
  Image image;
  std::string file;    ///< source; unique in its set
  std::string label;   ///< class: knit
  std::string object;  ///< the pressed object, such as KNIT2; all its imprints are of one class
};

/// One row per imprint; groups are the objects. Refuses no imprint, what PlannedFeatures refuses,
/// and what an extraction refuses (with the file). `threads` 0: one per core.
Result<FeatureMatrix> build_matrix(std::span<const Imprint> imprints, const FeaturePlan& plan,
                                   std::size_t threads = 0);
/// The paper's features at the options' scales.
Result<FeatureMatrix> build_matrix(std::span<const Imprint> imprints, const ScaleOptions& options,
                                   std::size_t threads = 0);

/// Classes in the order of their first row, and the class of every row. This order decides equal
/// products.
struct Classes {
  std::vector<std::string> names;
  std::vector<std::size_t> of_row;
};
Classes find_classes(std::span<const std::string> labels);

// The array of the imprints, as far as a model of imprints needs it.

/// An array, or its scanned part.
struct TaxelGrid {
  std::size_t rows = 0, cols = 0;
  double pitch_m = 0.0;        ///< distance of two taxels; 0: unknown
  std::size_t count_bits = 0;  ///< bits of a count; 0: unknown
};

/// True if imprints of both are comparable: equal rows and columns, and, if both are known, equal
/// bits and a pitch equal to 1 % (scales are in taxels).
bool is_same_grid(const TaxelGrid& a, const TaxelGrid& b);

/// "32 x 32 taxels, 0.281 mm apart, counts of 7 bits".
std::string format_grid(const TaxelGrid& grid);

/// Refuses an imprint of another size, and, if the bits are known, a count out of their range.
Status check_imprint(const TaxelGrid& grid, const Imprint& imprint);

}  // namespace weft::classifier::imprint
