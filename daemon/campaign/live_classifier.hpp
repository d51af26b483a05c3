#pragma once
// Runs the models that a recipe names while the probe slides.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "classifier/live/staged_model.hpp"
#include "drivers/api/sample.hpp"
#include "recipes/engine/plan.hpp"

namespace weft::daemon {

/// One live vote, reported while the probe slides.
struct LiveVoteUpdate {
  std::size_t trial = 0;
  std::string fabric;  ///< on the plate, from the plan; the vote does not use it
  std::string exploration;
  std::uint32_t repetition = 0;
  double slide_s = 0;  ///< time since phase M began
  std::string winner;
  std::vector<std::pair<std::string, double>> probability;  ///< per label; empty: unknown
  bool none_of_these = false;
  std::string model_bench;  ///< bench kind of the training data: "simulated", "real", "unknown"
  bool ends_slide = false;  ///< the vote is sure, and the recipe ends the stroke then
};

/// A model named by a recipe.
struct LiveModel {
  std::filesystem::path file;
  std::string sha256;  ///< of the file
  std::shared_ptr<const classifier::StagedModel> model;
};
/// By exploration of the plan; empty without a live vote.
using LiveModels = std::vector<std::optional<LiveModel>>;

/// Refuses models above 256 MiB. Errors: range, with a hint.
Status check_live_model_size(std::uintmax_t bytes);

/// Reads the models of `plan` from `folder`. Errors, each with the exploration's pointer: the
/// file's, check_live_model_size()'s, load_staged()'s. Also: exploration, taxel count or sample
/// rate differ from the model's; a sure vote ends the stroke, but the model has no probabilities or
/// comes from another kind of bench.
Result<LiveModels> load_live_models(const recipes::Plan& plan, const std::filesystem::path& folder);
/// Checks the first kilobytes of each model, in milliseconds for any size. Same errors, except
/// those in the rest of the file and missing probabilities.
Status check_live_models(const recipes::Plan& plan, const std::filesystem::path& folder);

/// Kind of the journal entry with live_models_json(), once per campaign.
inline constexpr const char* live_models_kind = "live_models";
/// The model of every exploration: [{exploration, model, sha256, ...}].
std::string live_models_json(const recipes::Plan& plan, const LiveModels& models);

/// Feeds the frames of a campaign to the voter of the current exploration.
class LiveClassifier {
 public:
  /// Both outlive it.
  LiveClassifier(const recipes::Plan& plan, const LiveModels& models);

  void begin(std::size_t trial);
  /// A vote if one was due. Errors: the features' and the model's; the trial then has no further
  /// votes.
  Result<std::optional<LiveVoteUpdate>> on_sample(const Sample& sample, Phase phase);
  /// The last vote was sure, and the recipe ends the stroke then.
  [[nodiscard]] bool slid_enough() const { return slid_enough_; }

 private:
  [[nodiscard]] LiveVoteUpdate to_update(const classifier::LivePrediction& answer) const;

  const recipes::Plan* plan_;
  std::vector<std::optional<classifier::LiveVoter>> voters_;  // by exploration
  classifier::LiveVoter* voter_ = nullptr;                    // of the current trial
  std::size_t trial_ = 0;
  bool slid_enough_ = false;
  std::vector<double> frame_;
};

}  // namespace weft::daemon
