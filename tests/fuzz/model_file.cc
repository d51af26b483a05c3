// Model files: any bytes give an error or a model that can be stored, read back and used.

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "classifier/model/stored_model.hpp"
#include "tests/fuzz/checksum.hpp"
#include "tests/fuzz/target.hpp"

namespace weft::fuzz::model_file_target {
namespace {

using classifier::StoredModel;

Result<StoredModel> load(const std::string& text) {
  std::istringstream in(text);
  return classifier::load_model<classifier::FeatureSetup>(in);
}

std::string save(const StoredModel& model) {
  std::ostringstream out;
  demand(classifier::save_model(model, out).has_value(), "a model that was read can be stored");
  return out.str();
}

void check(const StoredModel& stored, const classifier::Prediction& answer) {
  demand(answer.ballot.winner < stored.learner.labels().size(), "the winner is a label");
  for (const double f : answer.ballot.decision) demand(std::isfinite(f), "decisions are finite");
  for (const double s : answer.ballot.support) demand(std::isfinite(s), "supports are finite");
  for (const double p : answer.probability)
    demand(p >= 0.0 && p <= 1.0, "probabilities are from 0 to 1");
}

void query(const StoredModel& stored) {
  using classifier::VoteKind;
  const std::size_t columns = stored.learner.feature_names().size();
  for (const double value : {0.0, 1.0, -1e300, 1e300})
    for (const VoteKind kind :
         {VoteKind::majority, VoteKind::soft, VoteKind::dag, VoteKind::shortlist}) {
      const std::vector<double> features(columns, value);
      const auto with =
          classifier::predict(stored.learner, stored.postprocessing, features, {.kind = kind});
      if (with) check(stored, *with);
      const auto without =
          classifier::predict(stored.learner, std::nullopt, features, {.kind = kind});
      if (without) check(stored, *without);
    }
}

void try_text(const std::string& text) {
  const auto model = load(text);
  if (!model) return demand(!model.error().what.empty(), "an error says what is wrong");
  const std::string stored = save(*model);
  const auto again = load(stored);
  demand(again.has_value(), "a stored model can be read");
  demand(save(*again) == stored, "a model comes back bit for bit");
  query(*model);
}

}  // namespace

WEFT_FUZZ_TARGET(model_file) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  try_text(text);
  try_text(with_checksum(text));
  return 0;
}

}  // namespace weft::fuzz::model_file_target
