#pragma once
// The models that a recipe names, asked while their slides go on.

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

/// One vote, told while the probe slides.
struct LiveVoteUpdate {
  std::size_t trial = 0;
  std::string fabric;  ///< on the plate, by the plan; the vote does not know it
  std::string exploration;
  std::uint32_t repetition = 0;
  double slide_s = 0;  ///< of phase M so far
  std::string winner;
  std::vector<std::pair<std::string, double>> probability;  ///< per label; empty: not known
  bool none_of_these = false;
  std::string model_bench;  ///< whose data the model learnt from: "simulated", "real", "unknown"
  bool ends_slide = false;  ///< sure, and the recipe wants the slide to end with that
};

/// A model as a recipe names it.
struct LiveModel {
  std::filesystem::path file;
  std::string sha256;  ///< of the file
  std::shared_ptr<const classifier::StagedModel> model;
};
/// By exploration of the plan; empty where it has no live vote.
using LiveModels = std::vector<std::optional<LiveModel>>;

/// Models of more bytes are not loaded: 256 MiB. Errors: range, with a hint.
Status check_live_model_size(std::uintmax_t bytes);

/// Reads what `plan` names, from `folder`. Errors, each with the exploration's pointer: the file's,
/// check_live_model_size()'s, load_staged()'s; another exploration, taxel count or sample rate than
/// the model's; a slide that is to end once it is sure by a model that knows no probability, or of
/// another kind of bench.
Result<LiveModels> load_live_models(const recipes::Plan& plan, const std::filesystem::path& folder);
/// What can be told from the first kilobytes of each, in milliseconds whatever their size: the same
/// errors, but for what is wrong with the rest of the file and for probabilities.
Status check_live_models(const recipes::Plan& plan, const std::filesystem::path& folder);

/// The journal's line with live_models_json(), once a campaign.
inline constexpr const char* live_models_kind = "live_models";
/// Which model every exploration is asked with: [{exploration, model, sha256, ...}].
std::string live_models_json(const recipes::Plan& plan, const LiveModels& models);

/// Feeds the frames of a campaign to the voter of the exploration under way.
class LiveClassifier {
 public:
  /// Both outlive it.
  LiveClassifier(const recipes::Plan& plan, const LiveModels& models);

  void begin(std::size_t trial);
  /// A vote where one was due. Errors: the features' and the model's; the trial has no more votes.
  Result<std::optional<LiveVoteUpdate>> on_sample(const Sample& sample, Phase phase);
  /// The last vote was sure, and the recipe wants the slide to end with that.
  [[nodiscard]] bool slid_enough() const { return slid_enough_; }

 private:
  [[nodiscard]] LiveVoteUpdate to_update(const classifier::LivePrediction& answer) const;

  const recipes::Plan* plan_;
  std::vector<std::optional<classifier::LiveVoter>> voters_;  // by exploration
  classifier::LiveVoter* voter_ = nullptr;                    // of the trial under way
  std::size_t trial_ = 0;
  bool slid_enough_ = false;
  std::vector<double> frame_;
};

}  // namespace weft::daemon
