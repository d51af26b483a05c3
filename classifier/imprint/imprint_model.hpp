#pragma once
// A trained learner of imprints as a file, with what is needed to take features as those of the
// training were taken: text, versioned, self-describing, closed by a checksum, like the model files
// of fabrics and of recordings.

#include <iosfwd>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "classifier/fabric/model_text.hpp"
#include "classifier/imprint/imprint_set.hpp"
#include "classifier/learners/learner.hpp"
#include "classifier/vote/postprocessing.hpp"
#include "classifier/vote/vote.hpp"

namespace weft::classifier::imprint {

/// How an imprint becomes the feature vector that the learner takes.
struct ImprintSetup {
  TaxelGrid grid;
  FeaturePlan features;
};

struct ImprintModel {
  Provenance provenance;
  ImprintSetup setup;
  TrainedLearner learner;
  std::optional<VotePostprocessing> postprocessing =
      {};  ///< absent: no probability, nothing refused
};

/// First line of every file.
/// Learners may be added to it: a program that does not know one says so by name.
inline constexpr std::string_view imprint_model_header = "weft-imprint-model 1";

/// Refuses a model whose features are not those of its plan; Errc::io when the stream fails.
Status save_imprint_model(const ImprintModel& model, std::ostream& out);
/// The same answers, bit for bit. Errors: parse (not such a file), unsupported (another version),
/// corrupt (cut short or altered; names the line where that is known).
Result<ImprintModel> load_imprint_model(std::istream& in);

/// One answer per imprint, which come from `grid`. Refuses another array than the training had, as
/// is_same_grid() and check_imprint() say, and what build_matrix() and predict() refuse.
Result<std::vector<Prediction>> classify_imprints(const ImprintModel& model, const TaxelGrid& grid,
                                                  std::span<const Imprint> imprints,
                                                  const VoteOptions& options = {});

}  // namespace weft::classifier::imprint
