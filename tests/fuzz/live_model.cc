// Models of the live vote: any bytes give an error or a model. A model can be stored and read back,
// with the same head.

#include <sstream>
#include <string>

#include "classifier/live/staged_model.hpp"
#include "tests/fuzz/checksum.hpp"
#include "tests/fuzz/target.hpp"

namespace weft::fuzz::live_model_target {
namespace {

using classifier::StagedModel;

Result<StagedModel> load(const std::string& text) {
  std::istringstream in(text);
  return classifier::load_staged(in);
}

std::string save(const StagedModel& model) {
  std::ostringstream out;
  demand(classifier::save_staged(model, out).has_value(), "a model that was read can be stored");
  return out.str();
}

Result<classifier::StagedHead> head_of(const std::string& text) {
  std::istringstream in(text);
  return classifier::load_staged_head(in);
}

void try_text(const std::string& text) {
  const auto head = head_of(text);
  if (!head) demand(!head.error().what.empty(), "an error says what is wrong");
  const auto model = load(text);
  if (!model) return demand(!model.error().what.empty(), "an error says what is wrong");
  demand(!model->stages.empty() && model->sample_rate_hz > 0, "a model has a stage and a rate");
  if (head) demand(head->sample_rate_hz == model->sample_rate_hz, "the head says the same rate");
  const std::string stored = save(*model);
  const auto again = load(stored);
  demand(again.has_value(), "a stored model can be read");
  demand(save(*again) == stored, "a model comes back bit for bit");
}

}  // namespace

WEFT_FUZZ_TARGET(live_model) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  try_text(text);
  try_text(with_checksum(text));
  return 0;
}

}  // namespace weft::fuzz::live_model_target
