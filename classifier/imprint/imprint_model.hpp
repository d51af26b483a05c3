#pragma once
// A trained model of imprints: the preparation of features as in the training, and predictions.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "classifier/imprint/imprint_set.hpp"
#include "classifier/model/model_file.hpp"
#include "classifier/vote/vote.hpp"

namespace weft::classifier {

namespace imprint {

/// How an imprint becomes the feature vector for the learner.
struct ImprintSetup {
  TaxelGrid grid;
  FeaturePlan features;
};

}  // namespace imprint

template <>
struct SetupText<imprint::ImprintSetup> {
  static constexpr Modality modality = Modality::imprint;
  static void write(LineWriter& out, const imprint::ImprintSetup& setup);
  static imprint::ImprintSetup read(LineReader& in);
  static Result<std::vector<std::string>> feature_names(const imprint::ImprintSetup& setup,
                                                        std::size_t most);
};

namespace imprint {

using ImprintModel = Model<ImprintSetup>;

/// Digest of the counts and their arrangement, not of name, label or object.
std::vector<std::uint64_t> content_digests(std::span<const Imprint> imprints);

/// One prediction per imprint; all come from `grid`. Refuses another array than in the training
/// (is_same_grid(), check_imprint()), and what build_matrix() and predict() refuse.
Result<std::vector<Prediction>> classify_imprints(const ImprintModel& model, const TaxelGrid& grid,
                                                  std::span<const Imprint> imprints,
                                                  const VoteOptions& options = {});

}  // namespace imprint
}  // namespace weft::classifier
