#include "daemon/campaign/campaign.hpp"

#include <nlohmann/json.hpp>

#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/campaign/bench_pace.hpp"
#include "daemon/campaign/bench_session.hpp"
#include "daemon/campaign/campaign_file.hpp"
#include "daemon/campaign/promise_text.hpp"
#include "daemon/campaign/resume.hpp"
#include "daemon/campaign/simulation.hpp"
#include "daemon/campaign/supervisor.hpp"
#include "daemon/storage/recorder/campaign_folder.hpp"

namespace weft::daemon {
namespace {

using nlohmann::json;

double seconds_since(std::chrono::nanoseconds begin) {
  return std::chrono::duration<double>(steady_wall_now() - begin).count();
}

inline bool signalled(const CampaignHooks& hooks) {
  return hooks.stop != nullptr && hooks.stop->load(std::memory_order_relaxed);
}

bool stop_requested(const CampaignHooks& hooks) {
  return signalled(hooks) || (hooks.orders != nullptr && hooks.orders->ends_run());
}

std::optional<double> requested_accuracy_n(const SimulationNote& note) {
  return note.promise ? std::optional(note.promise->requested_n) : std::nullopt;
}

// The parts of a run in progress and its reports to the hooks.
class Run {
 public:
  Run(const SettledRequest& settled, BenchSession& session, const CampaignHooks& hooks,
      bool error_check)
      : plan_(&settled.checked.plan),
        session_(&session),
        hooks_(&hooks),
        log_(session.bench(), session.loop(), hooks.device_log),
        errors_(error_check ? session.plant() : nullptr, *plan_,
                requested_accuracy_n(settled.simulation)),
        live_(*plan_, settled.checked.models),
        keeper_(hooks.pace) {}

  Status bring_up() {
    Status up = daemon::bring_up(*session_, [this] { return stop_requested(*hooks_); });
    brought_up_ = session_->loop().now();
    return up;
  }

  /// Recorded trials that are not run again.
  struct History {
    recipes::Start from;
    std::size_t complete = 0, rejected = 0, ended_early = 0;
    std::size_t replayed = 0;  ///< trials that a simulated bench repeats without recording
  };
  static History make_history(const std::optional<ResumePlan>& before) {
    History out;
    if (!before) return out;
    if (before->is_replayed) {
      out.replayed = before->first_trial;
      return out;
    }
    out.from = {before->first_trial, before->rejected};
    out.complete = before->history.complete();
    out.rejected = before->history.rejected();
    out.ended_early = before->history.ended_early();
    return out;
  }

  CampaignSummary execute(Recorder& recorder, const History& history) {
    forecast_ =
        RunForecast(PlannedTime::of(*plan_, history.from.first_trial, session_->real_time()));
    complete_ = history.complete;
    rejected_ = history.rejected;
    ended_early_ = history.ended_early;
    TrialRecording recording(recorder, *plan_);
    log_.journal_to(&recording);
    SupervisorHooks hooks;
    hooks.mount = [this](const recipes::MountFabric& order, MountDone done) {
      errors_.patch_follows();
      session_->mount(order, std::move(done));
    };
    hooks.trial_done = [&](const recipes::TrialDone& done, const ForceTally& force) {
      const bool whole = done.outcome == recipes::Outcome::complete && !done.ended_early;
      errors_.trial_done(done.trial, whole, session_->loop().now(), recording);
      notify(done, force, recording);
    };
    hooks.trial_begun = [this](std::size_t trial) { begin_trial(trial); };
    hooks.sensed = [&](const Sample& sample, Phase phase) {
      if (hooks_->frame_sampler != nullptr && !is_replaying_)
        hooks_->frame_sampler->on_sample(sample, phase);
      vote(sample, phase, recording);
    };
    hooks.slid_enough = [this] { return live_.slid_enough(); };
    Supervisor supervisor(*plan_, session_->loop(), session_->bench(), recording, std::move(hooks));
    is_replaying_ = history.replayed > 0;
    supervisor.start(history.from);
    session_->run_until([&] {
      if (signalled(*hooks_) && !std::exchange(stopping_, true)) abort(supervisor, recording);
      skip_completed_prompts(supervisor, history.replayed);
      publish_step(supervisor);
      if (auto notice = recorder.take_notice())
        log_.add({session_->loop().now(), LogLevel::warning, "recorder", std::move(*notice)});
      is_replaying_ = supervisor.state().trial < history.replayed;
      if (!is_replaying_) publish_live_frame();
      apply_pending_faults(supervisor, recording, history.replayed);
      apply_pending_orders(supervisor, recording, history.replayed);
      return supervisor.result().has_value();
    });
    log_.journal_to(nullptr);
    return summary(supervisor.result(), recording);
  }

  /// Simulates some trials again; the run is over and its outcome does not change.
  Status estimate_simulation_error(Recorder& recorder, CampaignSummary& summary) const {
    const auto began = steady_wall_now();
    SimulationNote& note = summary.simulation;
    note.errors = errors_.errors(std::move(note.errors));
    evaluate_promise(note);
    summary.time.error_check_s = seconds_since(began);
    if (hooks_->kept_trials && session_->plant() != nullptr)
      hooks_->kept_trials(*session_->plant(), errors_.trials());
    if (note.empty()) return {};
    if (note.budget) note.budget->achieved = summary.virtual_s / seconds_since(began_);
    const TimePoint now = session_->loop().now();
    if (Status ok = recorder.journal(now, "simulation", to_json(note)); !ok) return ok;
    if (!is_promise_missed(note)) return {};
    return recorder.journal(now, "promise_missed", json{{"text", format_promise(note)}}.dump());
  }

 private:
  // Operator steps before recorded trials are already done.
  void skip_completed_prompts(Supervisor& supervisor, std::size_t replayed) {
    while (supervisor.requested() != nullptr && supervisor.state().trial < replayed) {
      forecast_.skip_prompt(supervisor.requested()->prompt);
      supervisor.request(recipes::OperatorConfirmed{supervisor.requested()->ticket});
    }
  }

  void begin_trial(std::size_t trial) {
    live_.begin(trial);
    if (hooks_->frame_sampler == nullptr) return;
    const recipes::TrialSpec& spec = plan_->trials[trial];
    hooks_->frame_sampler->begin_trial(plan_->explorations[spec.exploration]);
  }

  // Not called during a replay, which is neither shown nor slowed down.
  void publish_live_frame() {
    if (hooks_->frame_sampler != nullptr)
      hooks_->frame_sampler->show(session_->bench().snapshot(), session_->loop().now());
    throttle();
  }

  // An order ends the wait. It takes effect at the present bench time.
  void throttle() {
    constexpr std::chrono::milliseconds shortest{1}, longest{100};
    if (hooks_->orders == nullptr || session_->plant() == nullptr) return;
    if (keeper_.requested() == 0) {  // as fast as possible: the clock is not read
      keeper_.ahead(session_->loop().now(), {});
      return;
    }
    while (!signalled(*hooks_)) {
      const auto ahead = keeper_.ahead(session_->loop().now(), steady_wall_now());
      if (ahead < shortest) return;
      const auto wait = std::chrono::duration_cast<std::chrono::milliseconds>(ahead);
      if (hooks_->orders->wait(std::min(wait, longest))) return;
    }
  }

  // Virtual time would jump over a pause, so a simulated bench waits for orders here.
  void apply_pending_orders(Supervisor& supervisor, TrialRecording& recording,
                            std::size_t replayed) {
    if (hooks_->orders == nullptr) return;
    constexpr std::chrono::milliseconds poll_interval{100};
    const recipes::Step step = supervisor.state().step;
    const bool is_waiting = step == recipes::Step::held || step == recipes::Step::awaiting_operator;
    if (is_waiting && session_->plant() != nullptr)
      while (!signalled(*hooks_) && !hooks_->orders->wait(poll_interval))
        apply_pending_faults(supervisor, recording, replayed);
    if (hooks_->orders->is_idle()) return;  // the usual case, checked at every event
    while (const auto given = hooks_->orders->take()) {
      apply_order(*given, supervisor, recording);
      if (given->order == Order::halt) session_->forbid_lift();
      supervisor.request(event_of(*given));
    }
  }

  // Faults wait until a replay is over: the recorded trials had none.
  void apply_pending_faults(const Supervisor& supervisor, TrialRecording& recording,
                            std::size_t replayed) {
    if (hooks_->orders == nullptr || hooks_->orders->is_idle()) return;
    while (supervisor.state().trial >= replayed) {
      auto given = hooks_->orders->next_fault();
      if (!given) return;
      const auto notify = given->callback;
      given->callback = [this, notify, &recording,
                         line = json{{"fault", json::parse(given->json)},
                                     {"ends", given->ends},
                                     {"by", given->by}}](const Status& done) {
        if (done) recording.journal(session_->loop().now(), fault_kind, line.dump());
        notify(done);
      };
      session_->inject_fault(*given);
    }
  }

  void apply_order(const GivenOrder& given, const Supervisor& supervisor,
                   TrialRecording& recording) {
    json line{{"order", to_string(given.order)}, {"by", given.by}};
    const recipes::PromptOperator* const requested = supervisor.requested();
    if (given.order == Order::confirm && requested != nullptr &&
        requested->ticket == given.confirms) {
      line["trial"] = requested->prompt.trial;
      line["text"] = requested->prompt.text;
      forecast_.on_confirmed(requested->prompt);
    }
    recording.journal(session_->loop().now(), "order", line.dump());
  }

  void publish_step(const Supervisor& supervisor) {
    const recipes::State& state = supervisor.state();
    const recipes::PromptOperator* const requested = supervisor.requested();
    if (state.step == last_step_ && (requested == nullptr || state.ticket == last_polled_)) return;
    last_step_ = state.step;
    last_polled_ = state.ticket;
    const double bench_s = to_seconds(session_->loop().now());
    forecast_.on_step(state.step, bench_s, keeper_.requested(), steady_wall_now());
    if (!hooks_->moment) return;
    const recipes::TrialSpec& spec = plan_->trials[std::min(state.trial, plan_->trials.size() - 1)];
    RunStatusUpdate moment{state.trial,
                           plan_->trials.size(),
                           state.step,
                           plan_->fabrics[spec.fabric],
                           plan_->explorations[spec.exploration].name,
                           spec.repetition,
                           bench_s,
                           forecast_};
    if (requested != nullptr)
      moment.requested = *requested;
    else
      moment.next_prompt =
          next_prompt(state.step == recipes::Step::held ? state.trial : state.trial + 1);
    hooks_->moment(moment);
  }

  /// `from` never decreases.
  const std::optional<recipes::StepPrompt>& next_prompt(std::size_t from) {
    if (!std::exchange(has_next_prompt_, true) || (next_prompt_ && next_prompt_->trial < from))
      next_prompt_ = recipes::next_prompt(*plan_, from);
    return next_prompt_;
  }

  // A failed vote is no failure of the trial: the stroke continues to its full length.
  void vote(const Sample& sample, Phase phase, TrialRecording& recording) {
    const auto callback = live_.on_sample(sample, phase);
    if (!callback)
      return recording.journal(session_->loop().now(), "live_vote_error",
                               json{{"error", to_string(callback.error())}}.dump());
    if (!*callback) return;
    const LiveVoteUpdate& vote = **callback;
    if (vote.ends_slide)
      recording.journal(session_->loop().now(), "slide_ends_early",
                        json{{"trial", vote.trial},
                             {"slide_s", vote.slide_s},
                             {"winner", vote.winner},
                             {"by", "auto:live_vote"}}
                            .dump());
    if (hooks_->vote) hooks_->vote(vote);
  }

  void abort(Supervisor& supervisor, TrialRecording& recording) {
    recording.journal(session_->loop().now(), "stop_requested", "{}");
    supervisor.request(recipes::AbortRequested{});
  }

  void notify(const recipes::TrialDone& done, const ForceTally& force, TrialRecording& recording) {
    const recipes::TrialSpec& spec = plan_->trials[done.trial];
    const bool again = done.outcome == recipes::Outcome::rejected;
    complete_ += done.outcome == recipes::Outcome::complete ? 1 : 0;
    rejected_ += again ? 1 : 0;
    ended_early_ += done.ended_early ? 1 : 0;
    const bool is_over = done.outcome == recipes::Outcome::complete ||
                         // Otherwise the trial is repeated.
                         done.outcome == recipes::Outcome::failed;
    const double bench_s = to_seconds(session_->loop().now());
    if (is_over)
      forecast_.on_trial(done.trial + 1, bench_s, keeper_.requested(), steady_wall_now());
    if (done.error)
      recording.journal(session_->loop().now(), again ? "take_rejected" : "trial_error",
                        json{{"trial", done.trial}, {"error", to_string(*done.error)}}.dump());
    if (!hooks_->progress) return;
    TrialProgress line;
    line.done = done.trial + (is_over ? 1 : 0);
    line.error = done.error;
    line.attempts_rejected = rejected_;
    line.planned = plan_->trials.size();
    line.fabric = plan_->fabrics[spec.fabric];
    line.exploration = plan_->explorations[spec.exploration].name;
    line.repetition = spec.repetition;
    line.outcome = done.outcome;
    if (force.samples > 0) line.force_rms_error_n = force.rms_n();
    line.frames_lost = recording.frames_lost();
    line.recorder_lag_s = recording.commit_lag_s();
    line.virtual_s = bench_s;
    line.wall_s = seconds_since(began_);
    line.wall_left_s = forecast_.left_s(keeper_.requested(), steady_wall_now());
    hooks_->progress(line);
  }

  CampaignSummary summary(const std::optional<recipes::CampaignDone>& done,
                          const TrialRecording& recording) const {
    CampaignSummary s;
    s.name = plan_->name;
    s.outcome = done ? done->outcome : recipes::Outcome::failed;
    s.cleanup = done ? done->cleanup : recipes::Cleanup::failed;
    s.rig = done ? done->rig : recipes::RigFact::unknown;
    s.error = done ? done->error : std::nullopt;
    s.trials_planned = plan_->trials.size();
    s.trials_complete = complete_;
    s.attempts_rejected = rejected_;
    s.trials_ended_early = ended_early_;
    fail_where_trials_lack(s);
    s.forecast_s = plan_->forecast.duration_s;
    s.virtual_s = to_seconds(session_->loop().now());
    s.bring_up_s = to_seconds(brought_up_);
    s.force = recording.campaign_force();
    const SessionLoad load = session_->load();
    s.time.plant_and_emulators_s = load.plant_and_emulators_s;
    s.time.recorder_s = recording.seconds();
    s.time.drivers_and_control_s = std::max(0.0, load.drivers_and_control_s - recording.seconds());
    s.events = load.events;
    return s;
  }

  const recipes::Plan* plan_;
  BenchSession* session_;
  const CampaignHooks* hooks_;
  DeviceLog log_;
  ErrorCheck errors_;
  LiveClassifier live_;
  PaceKeeper keeper_;
  bool stopping_ = false;
  recipes::Step last_step_ = recipes::Step::ready;
  recipes::Ticket last_polled_ = 0;
  RunForecast forecast_;
  bool has_next_prompt_ = false;
  bool is_replaying_ = false;  ///< trials that are on record
  std::optional<recipes::StepPrompt> next_prompt_;
  std::size_t complete_ = 0;
  std::size_t rejected_ = 0;  ///< attempts
  std::size_t ended_early_ = 0;
  TimePoint brought_up_;
  std::chrono::nanoseconds began_ = steady_wall_now();
};

/// The campaign of the folder, if the request resumes it.
Result<std::optional<ResumePlan>> make_history(const CampaignRequest& request,
                                               const std::filesystem::path& campaign,
                                               const SettledRequest& settled,
                                               const CampaignHooks& hooks) {
  if (request.resume)
    return resume_plan(campaign, settled.checked, settled.rig.mode, request.accept_whole,
                       [&hooks] { return stop_requested(hooks); });
  Status free = Recorder::refuse_existing(campaign);
  if (free) free = require_no_existing_dataset(request.out);
  if (!free) return pass(free.error());
  return std::optional<ResumePlan>{};
}

/// Finishes the campaign's file; it is not written afterwards. If it cannot be written, no error
/// check runs and earlier findings decide about the promise.
Status finished(Recorder recorder, const Run& run, TimePoint now, CampaignSummary& summary) {
  evaluate_promise(summary.simulation);
  Status ok = recorder.resume_recording(now);
  if (ok) ok = run.estimate_simulation_error(recorder, summary);
  if (ok) ok = recorder.finish();
  return ok;
}

}  // namespace

std::string format_ended_early(const CampaignSummary& summary) {
  if (summary.trials_ended_early == 0) return {};
  return ", " + std::to_string(summary.trials_ended_early) +
         " of them ended early and excluded from the data set";
}

Result<CampaignSummary> run_campaign(const CampaignRequest& request, const CampaignHooks& hooks) {
  Result<SettledRequest> settled = settled_request(request);
  if (!settled) return pass(settled.error());
  const CheckedRequest& checked = settled->checked;
  const RigFile& rig = settled->rig;
  if (checked.plan.forecast.prompts > 0 && hooks.orders == nullptr)
    return fail({.code = Errc::unsupported,
                 .where = request.recipe.string(),
                 .what = "recipe has operator steps that cannot be confirmed here"});
  if (hooks.planned) hooks.planned(checked.plan);
  const auto began = steady_wall_now();
  const auto session = open_session({rig, request.rig, checked.plan.limits, checked.plan.seed,
                                     hooks.place, false, request.out / monitor_log_name});
  if (!session) return pass(session.error(), request.rig.string());
  const std::filesystem::path campaign_file = request.out / campaign_file_name;
  const auto folder = prepare_folder(request.out, disk_forecast(checked.plan));
  if (!folder) return pass(folder.error());
  const auto history = make_history(request, campaign_file, *settled, hooks);
  if (!history) return pass(history.error());
  if (*history && (*history)->only_concludes)
    return concluded(request.out, checked.plan, rig, (*history)->history);
  if (*history && ((*history)->only_runs_handover || (*history)->only_reports))
    return certified_summary(request.out, checked.plan, rig, (*history)->history);
  if (const std::string advice = (*session)->advice(); !advice.empty() && hooks.device_log)
    hooks.device_log({{}, LogLevel::warning, "bench", advice});
  Run run(*settled, **session, hooks, request.error_check);
  if (hooks.rig_acquired)
    if (Status taken = hooks.rig_acquired(); !taken) return pass(taken.error());
  if (Status up = run.bring_up(); !up) return pass(up.error());
  Result<Recorder> recorder = *history ? reopened(campaign_file, **history, **session)
                                       : created(campaign_file, *settled, **session);
  if (!recorder) return pass(recorder.error());
  CampaignSummary summary = run.execute(*recorder, Run::make_history(*history));
  summary.simulation = std::move(settled->simulation);
  // All trials were run again.
  if (*history && (*history)->is_replayed) summary.simulation.errors.clear();
  Status saved = finished(std::move(*recorder), run, (*session)->loop().now(), summary);
  summary.wall_s = seconds_since(began) - summary.time.error_check_s;
  summary.bench = rig.bench;
  summary.level = rig.plant_level;
  summary.campaign_file = campaign_file;
  summary.has_handover = checked.plan.handover.has_value();
  summary.states_handover = checked.plan.handover && !checked.plan.handover->by_default;
  if (saved) saved = conclude(request.out, summary);
  if (!saved) without_dataset(request.out, saved.error(), summary);
  return summary;
}

}  // namespace weft::daemon
