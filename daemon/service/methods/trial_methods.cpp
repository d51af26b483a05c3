// Trials of a run that has ended, one at a time, from its campaign file.

#include <map>
#include <nlohmann/json.hpp>

#include "daemon/service/methods/helpers.hpp"
#include "daemon/service/methods/trial_curves.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/recorder/trial_reader.hpp"

namespace weft::daemon::api {
namespace {

constexpr std::int64_t most_trials = 200, usual_trials = 50;
constexpr std::int64_t least_points = 10, usual_points = 1200, most_points = 5000;

std::filesystem::path campaign_of(const runs::StoredRun& run) {
  return run.folder / campaign_file_name;
}

/// Why attempts were rejected or failed, by trial of the plan, in order of time.
using Reasons = std::map<std::pair<std::uint32_t, TrialOutcome>, std::vector<std::string>>;

Result<Reasons> load_reasons(const std::filesystem::path& campaign) {
  const auto journal = load_journal(campaign);
  if (!journal) return pass(journal.error());
  Reasons out;
  for (const JournalEntry& entry : *journal) {
    const bool rejected = entry.kind == "take_rejected";
    if (!rejected && entry.kind != "trial_error") continue;
    const json payload = json::parse(entry.payload_json, nullptr, false);
    if (!payload.is_object()) continue;
    out[{payload.value("trial", std::uint32_t{0}),
         rejected ? TrialOutcome::rejected : TrialOutcome::failed}]
        .push_back(payload.value("error", ""));
  }
  return out;
}

/// Reason of each attempt in turn; null if none is recorded.
class ReasonsInTurn {
 public:
  explicit ReasonsInTurn(Reasons reasons) : reasons_(std::move(reasons)) {}
  json next(const TrialRecord& record) {
    const std::pair key(record.spec.index, record.outcome);
    const auto found = reasons_.find(key);
    const std::size_t turn = used_[key]++;
    if (found == reasons_.end() || turn >= found->second.size()) return nullptr;
    return found->second[turn];
  }

 private:
  Reasons reasons_;
  std::map<std::pair<std::uint32_t, TrialOutcome>, std::size_t> used_;
};

json number_or_null(const std::optional<double>& value) {
  return value ? json(*value) : json();
}

json rest_json(const std::optional<RestForces>& rest) {
  if (!rest) return nullptr;
  return {{"weight_N", rest->weight_n}, {"before_N", rest->before_n}, {"after_N", rest->after_n}};
}

/// Computed from the recorded wrench as for a complete trial; null without a wrench.
json worst_error_json(Dataset one, const std::vector<ForceTarget>& targets) {
  one.records.front().outcome = TrialOutcome::complete;
  const auto force = force_by_fabric(one, targets);
  if (force.empty() || force.front().tally.samples == 0) return nullptr;
  return force.front().tally.worst_n;
}

json attempt_json(const classifier::Trial& trial, const TrialRecord& record) {
  const TrialSpec& spec = record.spec;
  return {{"trial", trial.file},
          {"index", spec.index},
          {"attempt", spec.attempt},
          {"label", spec.label},
          {"exploration", spec.exploration},
          {"repetition", spec.repetition},
          {"piece", spec.place.piece},
          {"mounting", spec.place.mounting},
          {"patch", spec.place.patch},
          {"outcome", to_string(record.outcome)},
          {"lost_frames", record.lost_samples},
          {"force_rms_error_N", number_or_null(record.quality.force_rms_error_n)},
          {"force_in_band_share", number_or_null(record.quality.force_in_band_fraction)},
          {"rest", rest_json(record.quality.rest)}};
}

struct TrialPage {
  std::size_t from = 0, most = 0;
};

// Earlier attempts at the same trials are loaded too, to assign the reasons in turn.
Outcome trials_page(const runs::StoredRun& run, const TrialPage& page) {
  constexpr std::size_t before = 64;  // more than the attempts at one trial
  const std::size_t first = page.from - std::min(page.from, before);
  const auto listed = load_attempts(
      campaign_of(run),
      {.from = first, .most = page.from - first + page.most + 1, .has_samples = false});
  if (!listed) return refused(listed.error());
  auto loaded = load_reasons(campaign_of(run));
  if (!loaded) return refused(loaded.error());
  ReasonsInTurn reasons(std::move(*loaded));
  const auto targets = force_targets(listed->info);
  ListPage reply(page.most);
  json next;
  for (std::size_t i = 0; i < listed->records.size(); ++i) {
    const json reason = reasons.next(listed->records[i]);
    if (first + i < page.from) continue;
    json one = attempt_json(listed->trials[i], listed->records[i]);
    one["reason"] = reason;
    auto samples = load_attempts(campaign_of(run),
                                 {.from = first + i, .most = 1, .last_stream = Stream::wrench});
    if (!samples) return refused(samples.error());
    one["force_worst_error_N"] = worst_error_json(std::move(*samples), targets);
    if (reply.add(one)) continue;
    next = first + i;
    break;
  }
  return R"({"run":)" + format_text(run.id()) + R"(,"bench":)" +
         format_text(to_string(listed->info.kind)) + R"(,"trials":)" + reply.text() +
         R"(,"next":)" + format_text(next) + "}";
}

void list_trials(const Services& services, const Call& call, const Responder& respond) {
  const auto run = run_at_rest(services, call);
  if (!run) return respond(refused(run.error()));
  const auto from = read_whole_number(call, {"from", 0, 0, unbounded, "trial number out of range"});
  if (!from) return respond(refused(from.error()));
  const auto most = read_whole_number(
      call, {"most", usual_trials, 1, most_trials, "number of trials out of range"});
  if (!most) return respond(refused(most.error()));
  answer_in_background(
      services.file_background, respond,
      [stored = *run, page = TrialPage{*from, *most}] { return trials_page(stored, page); });
}

Outcome trial_curves(const runs::StoredRun& run, const std::string& name, std::size_t points) {
  const auto dataset =
      load_attempts(campaign_of(run), {.name = name, .last_stream = Stream::stages});
  if (!dataset) return refused(dataset.error());
  if (dataset->trials.empty())
    return refused({.code = Errc::not_found,
                    .where = "/params/trial",
                    .what = "run has no such trial",
                    .got = name.substr(0, 100),
                    .hint = "List its trials with data.trials"});
  json out = trial_curves_json(*dataset, 0, points, force_targets(dataset->info));
  out["run"] = run.id();
  return format_text(out);
}

void get_trial(const Services& services, const Call& call, const Responder& respond) {
  const auto run = run_at_rest(services, call);
  if (!run) return respond(refused(run.error()));
  const auto points = read_whole_number(
      call, {"points", usual_points, least_points, most_points, "number of points out of range"});
  if (!points) return respond(refused(points.error()));
  const std::string name = call.params.at("trial").get<std::string>();
  if (name.empty())
    return respond(
        refused(bad_param("trial", "trial name missing", "a name from data.trials", {})));
  answer_in_background(services.file_background, respond, [stored = *run, name, points = *points] {
    return trial_curves(stored, name, points);
  });
}

}  // namespace

void add_trial_methods(rpc::Methods& methods, const Services& services) {
  MethodGroup group(methods, services);
  group.read(
      "data.trials", "list all attempts of an ended run in pages, in the order of the plan",
      {run_param,
       {"from", ParamType::integer, false, "index of the first attempt (default: 0)"},
       {"most", ParamType::integer, false, "largest number of attempts, up to 200 (default: 50)"}},
      "run, bench, trials: trial (its name), index (of the plan), attempt, label, exploration, "
      "repetition, piece, mounting, patch, outcome, reason (of a rejection or failure), "
      "lost_frames; force_rms_error_N, force_worst_error_N, force_in_band_share (while the force "
      "was regulated); rest: weight_N, before_N, after_N; next",
      list_trials);
  group.read(
      "data.trial",
      "get the curves of one trial of an ended run, reduced for display: minimum and maximum at "
      "each point, null if samples are missing",
      {run_param,
       {"trial", ParamType::text, true, "name of the trial, from data.trials"},
       {"points", ParamType::integer, false,
        "largest number of points of a curve, 10 to 5000 (default: 1200)"}},
      "run, trial, bench, label, exploration, repetition, attempt, outcome, begin_s (bench time; "
      "other times are relative to it), phases: phase, begin_s, end_s; target: phase, "
      "force_N, band_N; force: t_s, fx_N, fy_N, fz_N (each min, max); stages: t_s, x_mm ... "
      "ry_deg (each min, max); taxels: mean_S_counts, mean_M_counts, t_s, counts (at most 300 "
      "frames)",
      get_trial);
}

}  // namespace weft::daemon::api
