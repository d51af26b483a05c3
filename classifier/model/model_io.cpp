#include "classifier/model/model_io.hpp"

#include <algorithm>

#include "classifier/fabric/provenance_text.hpp"
#include "classifier/vote/postprocessing_text.hpp"

namespace weft::classifier {

void write_model_parts(LineWriter& out, const TrainedLearner& learner,
                       const std::optional<VotePostprocessing>& postprocessing) {
  write_head(out, {learner.kind(), learner.view().kind()});
  write_labels(out, learner.labels());
  out.count("features", learner.feature_names().size());
  for (const std::string& feature : learner.feature_names()) out.text("feature", feature);
  write_learner(out, learner);
  write_postprocessing(out, postprocessing);
}

std::optional<ModelParts> read_model_parts(LineReader& in, const LearnerHead& head,
                                           std::vector<std::string> labels,
                                           const std::vector<std::string>& expected) {
  const std::size_t columns = in.count("features", expected.size(), expected.size());
  std::vector<std::string> features = read_names(in, "feature", columns);
  const auto other = std::mismatch(features.begin(), features.end(), expected.begin());
  if (other.first != features.end())
    in.refuse("features are not those that the file describes", *other.second, *other.first);
  auto learner = read_learner(in, head, std::move(labels), std::move(features));
  if (!learner) return std::nullopt;
  const std::size_t sigmoids = learner->cores() != nullptr ? learner->cores()->cores().size() : 0;
  auto postprocessing = read_postprocessing(in, learner->labels().size(), columns, sigmoids);
  if (!in.ok()) return std::nullopt;
  return ModelParts{std::move(*learner), std::move(postprocessing)};
}

}  // namespace weft::classifier
