// Model files of imprints and of recordings: any bytes give an error or a model that can be stored,
// read back and used.

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

template <class Model>
std::string saved(const Model& model) {
  std::ostringstream out;
  demand(classifier::save_model(model, out).has_value(), "a model that was read can be stored");
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

template <class Setup>
void try_text(const std::string& text) {
  const auto load = [](const std::string& one) {
    std::istringstream in(one);
    return classifier::load_model<Setup>(in);
  };
  const auto model = load(text);
  if (!model) return demand(!model.error().what.empty(), "an error says what is wrong");
  const std::string stored = saved(*model);
  const auto again = load(stored);
  demand(again.has_value(), "a stored model can be read");
  demand(saved(*again) == stored, "a model comes back bit for bit");
  query(*model);
}

}  // namespace

WEFT_FUZZ_TARGET(other_models) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  for (const std::string& one : {text, with_checksum(text)}) {
    try_text<weft::classifier::imprint::ImprintSetup>(one);
    try_text<weft::classifier::vibro::RecordingSetup>(one);
  }
  return 0;
}

}  // namespace weft::fuzz::other_models_target
