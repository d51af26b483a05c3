#include "daemon/campaign/live_classifier.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "daemon/base/file/read_file.hpp"
#include "daemon/base/file/sha256.hpp"

namespace weft::daemon {
namespace {

constexpr std::uintmax_t most_model_bytes = std::uintmax_t{1} << 28;

constexpr double same_rate = 0.01;  // relative; two rig files may round nominal rates differently

/// The kind of data of a rig's bench: an emulated bench makes simulated data.
std::string_view data_of(const recipes::RigLimits& limits) {
  return limits.bench == "real" ? "real" : "simulated";
}

/// Checks the head of a model against exploration and rig.
Status fits(const recipes::Exploration& exploration, const recipes::RigLimits& limits,
            double sample_rate_hz, const classifier::FeatureSetup& setup,
            const std::string& bench) {
  const auto other = [](const char* what, std::string expected, std::string got) {
    return fail({.code = Errc::invalid_argument,
                 .what = std::string("model trained ") + what,
                 .expected = std::move(expected),
                 .got = std::move(got)});
  };
  if (!setup.exploration.empty() && setup.exploration != exploration.name)
    return other("on another exploration", exploration.name, setup.exploration);
  if (setup.taxels != limits.taxels)
    return other("on another sensor", std::to_string(limits.taxels) + " taxels",
                 std::to_string(setup.taxels));
  if (std::abs(sample_rate_hz - limits.taxel_rate_hz) > same_rate * limits.taxel_rate_hz)
    return other("at another sample rate", std::to_string(limits.taxel_rate_hz) + " Hz",
                 std::to_string(sample_rate_hz) + " Hz");
  const bool other_bench = bench != "unknown" && bench != data_of(limits);
  if (exploration.live_vote->stop_early && other_bench)
    return fail({.code = Errc::unsupported,
                 .what = "model from another kind of bench cannot end slides",
                 .expected = "one trained on " + std::string(data_of(limits)) + " data",
                 .got = "one trained on " + bench + " data",
                 .hint = "Remove stop_early; the model then only votes"});
  return {};
}

Status knows_enough(const recipes::Exploration& exploration, const classifier::StagedModel& model) {
  const bool knows = std::ranges::all_of(
      model.stages, [](const auto& stage) { return stage.model.postprocessing.has_value(); });
  if (!exploration.live_vote->stop_early || knows) return {};
  return fail(
      {.code = Errc::unsupported,
       .what = "model without probabilities",
       .hint = "Train one with `weft fabric train --live` on at least 3 slides of each label"});
}

using recipes::Exploration;

Status check_size_of(const std::filesystem::path& file) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error)
    return fail({.code = Errc::not_found,
                 .where = file.string(),
                 .what = "file not readable",
                 .got = error.message()});
  const Status ok = check_live_model_size(size);
  return ok ? ok : Status(pass(ok.error(), file.string()));
}

Result<LiveModel> load(const Exploration& exploration, const recipes::RigLimits& limits,
                       const std::filesystem::path& file) {
  if (auto ok = check_size_of(file); !ok) return pass(ok.error());
  const auto text = read_text_file(file, most_model_bytes);
  if (!text) return pass(text.error());
  std::istringstream in(*text);
  auto model = classifier::load_staged(in);
  if (!model) return pass(model.error(), file.string());
  const classifier::StoredModel& last = model->last();
  Status ok = fits(exploration, limits, model->sample_rate_hz, last.setup, last.provenance.bench);
  if (ok) ok = knows_enough(exploration, *model);
  if (!ok) return pass(ok.error(), file.string());
  return LiveModel{file, sha256_hex(*text),
                   std::make_shared<const classifier::StagedModel>(std::move(*model))};
}

Status check_head(const Exploration& exploration, const recipes::RigLimits& limits,
                  const std::filesystem::path& file) {
  if (auto ok = check_size_of(file); !ok) return ok;
  std::ifstream in(file, std::ios::binary);
  const auto head = classifier::load_staged_head(in);
  if (!head) return pass(head.error(), file.string());
  const Status ok =
      fits(exploration, limits, head->sample_rate_hz, head->setup, head->provenance.bench);
  return ok ? ok : Status(pass(ok.error(), file.string()));
}

/// Calls `inspect` with each exploration that has a live vote, its index and its model's file.
template <class Inspect>
Status each_voting(const recipes::Plan& plan, const std::filesystem::path& folder,
                   const Inspect& inspect) {
  for (std::size_t i = 0; i < plan.explorations.size(); ++i) {
    const Exploration& exploration = plan.explorations[i];
    if (!exploration.live_vote) continue;
    // an absolute name stays as it is
    const std::filesystem::path file = folder / exploration.live_vote->model;
    if (const Status ok = inspect(exploration, i, file); !ok)
      return pass(ok.error(), "/explorations/" + exploration.name + "/live_vote/model");
  }
  return {};
}

}  // namespace

Status check_live_model_size(std::uintmax_t bytes) {
  if (bytes <= most_model_bytes) return {};
  return fail({.code = Errc::range,
               .what = "model too large for a live vote",
               .expected = "at most " + std::to_string(most_model_bytes) + " bytes",
               .got = std::to_string(bytes) + " bytes",
               .hint = "Train with fewer trials, or with another learner than trees"});
}

Result<LiveModels> load_live_models(const recipes::Plan& plan,
                                    const std::filesystem::path& folder) {
  LiveModels out(plan.explorations.size());
  const Status all = each_voting(
      plan, folder,
      [&](const Exploration& exploration, std::size_t i, const std::filesystem::path& file) {
        auto model = load(exploration, plan.limits, file);
        if (!model) return Status(pass(model.error()));
        out[i] = std::move(*model);
        return Status();
      });
  if (!all) return pass(all.error());
  return out;
}

Status check_live_models(const recipes::Plan& plan, const std::filesystem::path& folder) {
  return each_voting(
      plan, folder,
      [&](const Exploration& exploration, std::size_t, const std::filesystem::path& file) {
        return check_head(exploration, plan.limits, file);
      });
}

std::string live_models_json(const recipes::Plan& plan, const LiveModels& models) {
  nlohmann::json out = nlohmann::json::array();
  for (std::size_t i = 0; i < models.size(); ++i) {
    if (!models[i]) continue;
    const recipes::Exploration& exploration = plan.explorations[i];
    nlohmann::json one{{"exploration", exploration.name},
                       {"model", exploration.live_vote->model},
                       {"sha256", models[i]->sha256},
                       {"bench", models[i]->model->last().provenance.bench}};
    if (const auto& stop = exploration.live_vote->stop_early)
      one["stop_early"] = {{"sure_probability", stop->sure_probability},
                           {"least_slide_s", stop->least_slide_s}};
    out.push_back(std::move(one));
  }
  return out.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

LiveClassifier::LiveClassifier(const recipes::Plan& plan, const LiveModels& models) : plan_(&plan) {
  for (const auto& model : models) {
    voters_.emplace_back();
    if (model) voters_.back().emplace(model->model);
  }
}

void LiveClassifier::begin(std::size_t trial) {
  trial_ = trial;
  slid_enough_ = false;
  auto& voter = voters_[plan_->trials[trial].exploration];
  voter_ = voter ? &*voter : nullptr;
  if (voter_ != nullptr) voter_->restart();
}

Result<std::optional<LiveVoteUpdate>> LiveClassifier::on_sample(const Sample& sample, Phase phase) {
  const auto* taxels = std::get_if<TaxelSample>(&sample.value);
  if (voter_ == nullptr || taxels == nullptr) return std::optional<LiveVoteUpdate>{};
  frame_.assign(taxels->counts.begin(), taxels->counts.end());
  const auto answer = voter_->add(phase, frame_);
  if (!answer) {
    voter_ = nullptr;
    return pass(answer.error());
  }
  if (!*answer) return std::optional<LiveVoteUpdate>{};
  LiveVoteUpdate moment = to_update(**answer);
  slid_enough_ = moment.ends_slide;
  return std::optional<LiveVoteUpdate>(std::move(moment));
}

LiveVoteUpdate LiveClassifier::to_update(const classifier::LivePrediction& answer) const {
  const recipes::TrialSpec& trial = plan_->trials[trial_];
  const recipes::Exploration& exploration = plan_->explorations[trial.exploration];
  const std::vector<std::string>& labels = voter_->model().last().learner.labels();
  LiveVoteUpdate out;
  out.trial = trial_;
  out.fabric = plan_->fabrics[trial.fabric];
  out.exploration = exploration.name;
  out.repetition = trial.repetition;
  out.slide_s = answer.slide_s;
  out.winner = labels[answer.winner];
  for (std::size_t i = 0; i < answer.probability.size(); ++i)
    out.probability.emplace_back(labels[i], answer.probability[i]);
  out.none_of_these = answer.none_of_these;
  out.model_bench = voter_->model().last().provenance.bench;
  if (const auto& stop = exploration.live_vote->stop_early)
    out.ends_slide = classifier::is_sure({stop->sure_probability, stop->least_slide_s}, answer);
  return out;
}

}  // namespace weft::daemon
