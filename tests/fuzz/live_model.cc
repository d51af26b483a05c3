// Models for votes while a slide goes on: whatever the bytes, an error or a model that can be
// stored and read back, whose head says the same.

#include <algorithm>
#include <sstream>
#include <string>
#include <string_view>

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

/// The opening and every model with a checksum that is right, and the lengths of the models too.
std::string put_right(const std::string& text) {
  const std::string model_keyword = "weft-fabric-model ";
  std::string models, opening = text.substr(0, text.find(model_keyword));
  std::size_t stage = 0;
  for (std::size_t at = opening.size(); at < text.size();) {
    const std::size_t next = std::min(text.find(model_keyword, at + 1), text.size());
    const std::string model = with_checksum(std::string_view(text).substr(at, next - at));
    stage = opening.find("\nstage ", stage);
    if (stage == std::string::npos) return text;
    stage = std::min(opening.find(' ', stage + 7), opening.size());
    const std::size_t end = std::min(opening.find('\n', stage), opening.size());
    opening.replace(stage, end - stage, " " + std::to_string(model.size()));
    models += model;
    at = next;
  }
  return with_checksum(opening) + models;
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
  try_text(put_right(text));
  return 0;
}

}  // namespace weft::fuzz::live_model_target
