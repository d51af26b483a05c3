// Model files of imprints and of recordings: whatever the bytes, an error or a model that can be
// stored, read back and asked.

#include <sstream>
#include <string>
#include <vector>

#include "classifier/imprint/imprint_model.hpp"
#include "classifier/vibro/recording_model.hpp"
#include "classifier/vote/postprocessing.hpp"
#include "tests/fuzz/checksum.hpp"
#include "tests/fuzz/target.hpp"

namespace weft::fuzz::other_models_target {
namespace {

using classifier::imprint::ImprintModel;
using classifier::vibro::RecordingModel;

Result<ImprintModel> load(const std::string& text, const ImprintModel*) {
  std::istringstream in(text);
  return classifier::imprint::load_imprint_model(in);
}
Result<RecordingModel> load(const std::string& text, const RecordingModel*) {
  std::istringstream in(text);
  return classifier::vibro::load_recording_model(in);
}

Status save(const ImprintModel& model, std::ostream& out) {
  return classifier::imprint::save_imprint_model(model, out);
}
Status save(const RecordingModel& model, std::ostream& out) {
  return classifier::vibro::save_recording_model(model, out);
}

template <class Model>
std::string saved(const Model& model) {
  std::ostringstream out;
  demand(save(model, out).has_value(), "a model that was read can be stored");
  return out.str();
}

void query(const ImprintModel& model) {
  for (const double value : {0.0, 1.0, -1e300, 1e300}) {
    const std::vector<double> features(model.learner.feature_names().size(), value);
    const auto answer = classifier::predict(model.learner, model.postprocessing, features);
    if (!answer) continue;
    demand(answer->ballot.winner < model.learner.labels().size(), "the winner is a label");
    for (const double p : answer->probability)
      demand(p >= 0.0 && p <= 1.0, "probabilities are from 0 to 1");
  }
}

void query(const RecordingModel& model) {
  const auto columns =
      classifier::vibro::columns_of(model.setup.channels, model.setup.features).size();
  for (const double value : {0.0, 1.0, -1e300, 1e300}) {
    const auto label = model.learner.classify(std::vector<double>(columns, value));
    if (label) demand(*label < model.learner.labels().size(), "the answer is a label");
  }
}

template <class Model>
void try_text(const std::string& text) {
  constexpr const Model* kind = nullptr;
  const auto model = load(text, kind);
  if (!model) return demand(!model.error().what.empty(), "an error says what is wrong");
  const std::string stored = saved(*model);
  const auto again = load(stored, kind);
  demand(again.has_value(), "a stored model can be read");
  demand(saved(*again) == stored, "a model comes back bit for bit");
  query(*model);
}

}  // namespace

WEFT_FUZZ_TARGET(other_models) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  for (const std::string& one : {text, with_checksum(text)}) {
    try_text<weft::classifier::imprint::ImprintModel>(one);
    try_text<weft::classifier::vibro::RecordingModel>(one);
  }
  return 0;
}

}  // namespace weft::fuzz::other_models_target
