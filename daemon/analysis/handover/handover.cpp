#include "daemon/analysis/handover/handover.hpp"

#include <algorithm>
#include <functional>
#include <new>
#include <nlohmann/json.hpp>
#include <sstream>

#include "daemon/analysis/handover/train.hpp"
#include "daemon/analysis/report/headline.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/recorder/campaign_folder.hpp"
#include "daemon/storage/recorder/recorder.hpp"
#include "recipes/engine/plan.hpp"

namespace weft::daemon {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr std::size_t steps_per_exploration = 3;

fs::path campaign_in(const fs::path& folder) {
  return folder / campaign_file_name;
}

/// Checks the recorded recipe against the recorded rig.
Result<recipes::Plan> load_plan(const fs::path& folder) {
  const auto header = load_header(campaign_in(folder));
  if (!header) return pass(header.error());
  const DatasetInfo& info = header->info;
  const auto limits = recipes::parse_rig_limits(info.rig_json);
  if (!limits) return pass(limits.error(), folder.string());
  recipes::CheckReport report = recipes::check_recipe(info.recipe_json, *limits, info.seed);
  if (report.plan) return std::move(*report.plan);
  return fail({.code = Errc::corrupt,
               .where = folder.string(),
               .what = "recorded recipe invalid: " + recipes::to_string(report.problems.front())});
}

/// The certificate of a campaign with all planned trials done. Partial data is never used for
/// training.
Result<Certificate> complete_certificate(const fs::path& folder) {
  const auto read = read_certificate(folder);
  if (!read) return pass(read.error());
  if (!*read)
    return fail({.code = Errc::wrong_state,
                 .where = folder.string(),
                 .what = "campaign not finished",
                 .hint = "Resume the campaign until it is complete"});
  const auto done = std::ranges::count_if((*read)->trials, [](const CertifiedTrial& trial) {
    const auto outcome = trial_outcome_from(trial.outcome);
    return outcome && is_done(*outcome);
  });
  const std::string planned = std::to_string((*read)->trials_planned);
  if (static_cast<std::uint64_t>(done) < (*read)->trials_planned)
    return fail({.code = Errc::wrong_state,
                 .where = folder.string(),
                 .what = "campaign not complete",
                 .expected = planned + " trials",
                 .got = std::to_string(done) + " trials",
                 .hint = "Resume the campaign until it is complete"});
  return **read;
}

/// The complete trials, if they agree with the certificate.
Result<Dataset> certified_data(const fs::path& folder, const Certificate& certificate,
                               const StopRequested& stop) {
  auto data = load_campaign(campaign_in(folder), {.stop_requested = stop});
  if (!data) return pass(data.error());
  const std::string found = dataset_sha256(*data);
  if (found == certificate.dataset_sha256) return data;
  return fail({.code = Errc::corrupt,
               .where = folder.string(),
               .what = "campaign differs from its certificate",
               .expected = certificate.dataset_sha256,
               .got = found,
               .hint = "Run `weft verify` to list the differences"});
}

/// The recipe's time limit and the caller's stop.
class TimeLimit {
 public:
  TimeLimit(const HandoverHooks& hooks, double at_most_s)
      : hooks_(&hooks), at_most_s_(at_most_s), began_s_(now()) {}

  [[nodiscard]] bool is_over() const { return now() - began_s_ > at_most_s_; }
  [[nodiscard]] bool stops() const { return (hooks_->stop && hooks_->stop()) || is_over(); }
  /// Replaces the general "stopped" error by the actual cause.
  [[nodiscard]] Error limited(Error error) const {
    if (hooks_->stop && hooks_->stop())
      return {.code = Errc::wrong_state, .what = "handover stopped on request"};
    if (!is_over()) return error;
    return {.code = Errc::timeout,
            .where = "/hand_over/at_most_s",
            .what = "handover exceeded the time limit of its recipe",
            .expected = "at most " + general(at_most_s_) + " s",
            .hint = "Raise at_most_s, or use fewer trials or a faster learner"};
  }

 private:
  [[nodiscard]] double now() const { return hooks_->seconds_now ? hooks_->seconds_now() : 0; }
  const HandoverHooks* hooks_;
  double at_most_s_, began_s_;
};

/// The handover without writing its files.
class HandoverJob {
 public:
  HandoverJob(const Dataset& data, std::string dataset_sha256, const recipes::Plan& plan,
              const HandoverHooks& hooks, const TimeLimit& allowed)
      : data_(&data),
        sha256_(std::move(dataset_sha256)),
        plan_(&plan),
        hooks_(&hooks),
        announce_{hooks.progress} {
    options_.threads = hooks.threads;
    options_.stop = [&allowed] { return allowed.stops(); };
    for (const recipes::TrialSpec& trial : plan.trials)
      repetitions_ = std::max(repetitions_, trial.repetition);
  }

  Status work() {
    const std::vector<std::string> explorations = list_explorations(*data_);
    if (explorations.empty())
      return fail({.code = Errc::wrong_state,
                   .where = "/explorations",
                   .what = "no complete slide to learn from",
                   .hint = "Check whether the live vote ended all slides early"});
    announce_.progress.steps =
        explorations.size() *
        (from_vibration() ? vibration_steps(*plan_->handover) : steps_per_exploration);
    for (const std::string& exploration : explorations)
      if (Status ok = from_vibration() ? add_vibration(exploration) : add(exploration); !ok)
        return pass(ok.error(), exploration);
    return {};
  }

  [[nodiscard]] ordered_json evaluation() const {
    ordered_json out = handover_heading_json(data_->info, sha256_);
    out["hand_over"] = {{"from", to_string(plan_->handover->from)},
                        {"learner", plan_->handover->learner},
                        {"groups", plan_->handover->groups},
                        {"at_most_s", plan_->handover->at_most_s}};
    out["meaning"] =
        from_vibration()
            ? "No model is saved; this file only evaluates. The accuracy is cross-validated: each "
              "group of repetitions is tested by a learner chosen and trained without it."
            : "Each saved model is trained on all trials of its exploration. The accuracy is "
              "cross-validated: each group of repetitions is tested by a model trained without it.";
    out["models"] = models_;
    out["evaluations"] = evaluations_;
    out["explorations"] = explorations_;
    return out;
  }
  [[nodiscard]] const std::vector<HandoverText>& texts() const { return texts_; }

 private:
  [[nodiscard]] bool from_vibration() const {
    return plan_->handover->from == recipes::HandoverSource::vibration;
  }

  Status add_vibration(const std::string& exploration) {
    const auto set = vibration_material(
        *data_, exploration, recipes::repetition_groups(repetitions_, plan_->handover->groups));
    if (!set) return pass(set.error());
    const auto training_result =
        train_vibration(*set, *plan_->handover, *hooks_, options_.stop,
                        [&](const std::string& what) { announce_(exploration + ": " + what); });
    if (!training_result) return pass(training_result.error());
    const auto page = vibration_document(exploration, *set, *training_result);
    if (!page) return pass(page.error());
    evaluations_.push_back(evaluation_line_json(make_evaluation(
        exploration, std::string(handover_folder_name) + "/" + exploration + ".html", *set,
        *training_result)));
    explorations_[exploration] = vibration_json(*set, *training_result);
    return add_page(exploration, explorations_[exploration], *page, texts_);
  }

  Status add(const std::string& exploration) {
    const auto training_result =
        train_exploration(*data_, exploration, sha256_, *plan_->handover, repetitions_, options_,
                          *hooks_, std::ref(announce_));
    if (!training_result) return pass(training_result.error());
    std::ostringstream model;
    if (Status ok = classifier::save_model(training_result->model, model); !ok) return ok;
    texts_.push_back({exploration + ".model", model.str()});
    models_.push_back(model_line_json(exploration, texts_.back(), training_result->learner,
                                      training_result->material.trials.size(),
                                      training_result->evaluation));
    explorations_[exploration] = training_json(*training_result);
    return add_page(exploration, explorations_[exploration],
                    training_document(data_->info, *plan_->handover, *training_result), texts_);
  }

  const Dataset* data_;
  std::string sha256_;
  const recipes::Plan* plan_;
  const HandoverHooks* hooks_;
  classifier::TrainOptions options_;
  std::uint32_t repetitions_ = 0;
  StepAnnouncer announce_;
  ordered_json models_ = ordered_json::array(), evaluations_ = ordered_json::array(),
               explorations_ = ordered_json::object();
  std::vector<HandoverText> texts_;
};

Result<ordered_json> learn(const Dataset& data, const std::string& sha256,
                           const recipes::Plan& plan, const HandoverHooks& hooks,
                           const TimeLimit& allowed, std::vector<HandoverText>& texts) {
  if (plan.handover->from == recipes::HandoverSource::imprints)
    return run_imprint_handover(
        data, sha256, *plan.handover, hooks, [&] { return allowed.stops(); }, texts);
  HandoverJob job(data, sha256, plan, hooks, allowed);
  if (Status ok = job.work(); !ok) return pass(ok.error());
  texts = job.texts();
  return job.evaluation();
}

std::vector<HandoverText> records_of(const ordered_json& evaluation,
                                     const std::vector<HandoverText>& texts) {
  std::vector<HandoverText> out{{evaluation_file_name, evaluation.dump()}};
  for (const HandoverText& file : texts)
    if (file.name.ends_with(".json")) out.push_back(file);
  return out;
}

/// Adds the reported accuracies and the campaign's report, which uses the same ones. A failed
/// report does not fail the handover: "report_error" has the reason.
Status add_report(const Dataset& data, const HandoverHooks& hooks, ordered_json& evaluation,
                  std::vector<HandoverText>& texts) {
  const auto stopped = [&hooks] { return hooks.stop && hooks.stop(); };
  evaluation["results"] = ordered_json::array();
  for (const Headline& headline : handover_headlines(handover_result_from(evaluation), data))
    evaluation["results"].push_back(headline_json(headline));
  if (!hooks.report || stopped()) return {};
  if (hooks.progress) hooks.progress({0, 1, "report of the campaign"});
  auto report =
      hooks.report(data, handover_result_from(evaluation), records_of(evaluation, texts), stopped);
  if (stopped()) return fail({.code = Errc::wrong_state, .what = "handover stopped on request"});
  if (!report) {
    evaluation["report_error"] = to_string(report.error());
    return {};
  }
  for (HandoverText& file : *report) {
    // An exploration's page may have the same name.
    std::erase_if(texts, [&](const HandoverText& other) { return other.name == file.name; });
    texts.push_back(std::move(file));
  }
  return {};
}

Result<HandoverResult> run_whole_handover(const fs::path& folder, const HandoverHooks& hooks) {
  const auto lock = FolderLock::take(folder);
  if (!lock) return pass(lock.error());
  const auto certificate = complete_certificate(folder);
  if (!certificate) return pass(certificate.error());
  if (auto done = read_handover(folder);
      done && *done && (*done)->dataset_sha256 == certificate->dataset_sha256)
    return std::move(**done);
  const auto plan = load_plan(folder);
  if (!plan) return pass(plan.error());
  if (!plan->handover)
    return fail({.code = Errc::not_found,
                 .where = folder.string(),
                 .what = "recipe of the campaign has no hand_over"});
  const TimeLimit allowed(hooks, plan->handover->at_most_s);
  const auto data = certified_data(folder, *certificate, [&] { return allowed.stops(); });
  if (!data) return pass(allowed.limited(data.error()));
  std::vector<HandoverText> texts;
  auto evaluation = learn(*data, certificate->dataset_sha256, *plan, hooks, allowed, texts);
  if (!evaluation) return pass(allowed.limited(evaluation.error()));
  if (Status ok = add_report(*data, hooks, *evaluation, texts); !ok)
    return pass(allowed.limited(ok.error()));
  return write_handover(folder, std::move(*evaluation), texts);
}

}  // namespace

Result<std::optional<recipes::Handover>> load_handover_spec(const fs::path& folder) {
  auto plan = load_plan(folder);
  if (!plan) return pass(plan.error());
  return std::move(plan->handover);
}

Result<HandoverResult> run_handover(const fs::path& folder, const HandoverHooks& hooks) {
  try {
    return run_whole_handover(folder, hooks);
  } catch (const std::bad_alloc&) {
    return fail({.code = Errc::range,
                 .where = folder.string(),
                 .what = "campaign too large for the memory of this computer",
                 .hint = "Run the handover on a computer with more memory"});
  }
}

}  // namespace weft::daemon
