#include "daemon/campaign/trial_recording.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/base/loop/wall_clock.hpp"

namespace weft::daemon {
namespace {

constexpr unsigned timing_stride = 64;
constexpr std::chrono::seconds space_period{1};
/// Calls closer together than this are dense: the next `calls_unlooked` calls do not read the
/// clock.
constexpr std::chrono::microseconds dense_calls{500};
constexpr unsigned calls_unlooked = 15;
constexpr std::chrono::milliseconds rest_settles{300};  // wait after the probe came to rest

TrialOutcome recorded(recipes::Outcome outcome, bool ended_early) {
  switch (outcome) {
    case recipes::Outcome::complete:
      return ended_early ? TrialOutcome::ended_early : TrialOutcome::complete;
    case recipes::Outcome::stopped:
      return TrialOutcome::stopped;
    case recipes::Outcome::aborted:
      return TrialOutcome::aborted;
    case recipes::Outcome::failed:
      return TrialOutcome::failed;
    case recipes::Outcome::interrupted:
      return TrialOutcome::interrupted;
    case recipes::Outcome::rejected:
      return TrialOutcome::rejected;
  }
  return TrialOutcome::failed;
}

}  // namespace

void ForceTally::add(double error_n, double band_n) {
  ++samples;
  in_band += std::abs(error_n) <= band_n ? 1 : 0;
  sum_squares_n2 += error_n * error_n;
  worst_n = std::max(worst_n, std::abs(error_n));
}

double ForceTally::rms_n() const {
  return samples == 0 ? 0 : std::sqrt(sum_squares_n2 / static_cast<double>(samples));
}

void RestTally::add(double force_n) {
  ++count_;
  const double off_n = force_n - mean_n_;
  mean_n_ += off_n / static_cast<double>(count_);
  squares_n2_ += off_n * (force_n - mean_n_);
}

double RestTally::error_n() const {
  if (count_ < 2) return 0;
  const auto count = static_cast<double>(count_);
  return std::sqrt(squares_n2_ / (count - 1) / count);
}

// All calls of the recorder go through here: stores the first error and times one call in
// `timing_stride`.
template <class Write>
void TrialRecording::write(Write&& write) {
  const bool timed = ++writes_ % timing_stride == 0;
  const auto begin = timed ? steady_wall_now() : std::chrono::nanoseconds{};
  const Status ok = write();
  if (timed) spent_ += timing_stride * (steady_wall_now() - begin);
  if (!ok && !error_) error_ = ok.error();
}

double TrialRecording::seconds() const {
  return std::chrono::duration<double>(spent_).count();
}

void TrialRecording::begin(std::size_t trial, TimePoint now) {
  trial_ = trial;
  phase_ = Phase::none;
  trial_force_ = {};
  rest_before_ = rest_after_ = {};
  trial_bad_.reset();
  sampled_.clear();
  wrench_sampled_.clear();
  phases_.clear();
  if (quality_check_) quality_check_->begin();
  const recipes::TrialSpec& planned = plan_->trials[trial];
  TrialSpec spec;
  spec.index = static_cast<std::uint32_t>(planned.index);
  spec.label = plan_->fabrics[planned.fabric];
  spec.group = std::to_string(planned.repetition);
  spec.exploration = plan_->explorations[planned.exploration].name;
  spec.repetition = planned.repetition;
  spec.patch_seed = planned.seeds.touch;
  spec.place = {planned.place.piece, planned.place.mounting, planned.place.patch};
  spec.factors = plan_->explorations[planned.exploration].factors;
  spec.attempt = attempts_[trial]++;
  write([&] { return recorder_->begin_trial(spec, now); });
}

void TrialRecording::sensor(const Sample& sample, std::string_view device) {
  if (phase_ == Phase::none) return;
  const Stamp stamp{sample.host, sample.sequence, sample.lost, device};
  frames_lost_ += sample.lost;
  if (quality_check_) quality_check_->check(sample);
  if (const auto* shaken = std::get_if<AccelerationSample>(&sample.value)) {
    write([&] { return recorder_->acceleration(stamp, *shaken); });
  } else if (const auto* received = std::get_if<SoundSample>(&sample.value)) {
    write([&] { return recorder_->sound(stamp, *received); });
  } else if (const auto* taxels = std::get_if<TaxelSample>(&sample.value)) {
    sampled_.push_back(sample.host);
    write([&] { return recorder_->taxel(stamp, *taxels, phase_); });
  } else if (const auto* wrench = std::get_if<WrenchSample>(&sample.value)) {
    wrench_sampled_.push_back(sample.host);
    write([&] { return recorder_->wrench(stamp, *wrench); });
    // Phases are stored in rows of taxels, which have no counts here.
    if (plan_->limits.taxels == 0) {
      sampled_.push_back(sample.host);
      write([&] { return recorder_->taxel(stamp, {}, phase_); });
    }
    tally(wrench->force_n[2], sample.host);
  }
}

void TrialRecording::tally(double force_n, TimePoint at) {
  if (phase_ == Phase::rest || phase_ == Phase::end) {
    if (at - phase_began_ >= rest_settles)
      (phase_ == Phase::end ? rest_after_ : rest_before_).add(force_n);
    return;
  }
  const recipes::Exploration& exploration = plan_->explorations[plan_->trials[trial_].exploration];
  if (phase_ != exploration.held_phase()) return;
  const recipes::PhaseStep& step = exploration.step(phase_);
  trial_force_.add(force_n - step.force_n, step.force_band_n);
}

void TrialRecording::stages(const Snapshot& snapshot, TimePoint now) {
  if (phase_ == Phase::none) return;
  const recipes::Joints joints = snapshot.joints();
  write([&] { return recorder_->stages({now, ++stage_sequence_, 0}, joints.value); });
}

TrialRecording::TrialRecording(Recorder& recorder, const recipes::Plan& plan)
    : recorder_(&recorder), plan_(&plan) {
  if (plan.repeat_bad)
    quality_check_.emplace(*plan.repeat_bad, plan.limits.taxel_rate_hz, plan.limits.wrench_rate_hz);
}

void TrialRecording::set_phase(Phase phase, TimePoint now) {
  if (quality_check_ && phase_ != Phase::none && phase == Phase::none) quality_check_->pause(now);
  if (quality_check_ && phase_ == Phase::none && phase != Phase::none) quality_check_->resume(now);
  const bool whole = phase_ == Phase::end && phase == Phase::none;
  phase_ = phase;
  phase_began_ = now;
  phases_.push_back({phase, now});
  if (whole && quality_check_ && !trial_bad_)
    trial_bad_ = quality_check_->verdict(trial_force_.samples == 0
                                             ? 1.0
                                             : static_cast<double>(trial_force_.in_band) /
                                                   static_cast<double>(trial_force_.samples));
}

void TrialRecording::end(recipes::Outcome outcome, bool ended_early, TimePoint now) {
  phase_ = Phase::none;
  TrialQuality quality;
  if (trial_force_.samples > 0) {
    quality.force_rms_error_n = trial_force_.rms_n();
    quality.force_in_band_fraction =
        static_cast<double>(trial_force_.in_band) / static_cast<double>(trial_force_.samples);
  }
  const auto mean_n = [](const RestTally& rest) {
    return rest.count() > 0 ? rest.mean_n() : std::numeric_limits<double>::quiet_NaN();
  };
  if (rest_before_.count() > 0 || rest_after_.count() > 0)
    quality.rest = {plan_->limits.probe_weight_n, mean_n(rest_before_), mean_n(rest_after_)};
  if (outcome == recipes::Outcome::complete) {
    campaign_force_.samples += trial_force_.samples;
    campaign_force_.in_band += trial_force_.in_band;
    campaign_force_.sum_squares_n2 += trial_force_.sum_squares_n2;
    campaign_force_.worst_n = std::max(campaign_force_.worst_n, trial_force_.worst_n);
  }
  write([&] { return recorder_->end_trial(recorded(outcome, ended_early), quality, now); });
}

void TrialRecording::journal(TimePoint now, std::string_view kind, std::string_view payload_json) {
  write([&] { return recorder_->journal(now, kind, payload_json); });
}

std::optional<std::uint64_t> TrialRecording::free_bytes() {
  if (free_bytes_ && wall_ - space_seen_ < space_period) return free_bytes_;
  space_seen_ = wall_;
  free_bytes_ = recorder_->free_bytes();
  return free_bytes_;
}

std::optional<double> TrialRecording::commit_lag_s() {
  const auto lag = recorder_->commit_lag();
  if (!lag) return std::nullopt;
  return std::chrono::duration<double>(*lag).count();
}

// In virtual time calls are so dense that reading the clock would cost more than a commit. In real
// time that happens only while the loop catches up.
void TrialRecording::commit_if_due() {
  if (unlooked_ > 0) return static_cast<void>(--unlooked_);
  const auto before = std::exchange(wall_, steady_wall_now());
  if (wall_ - before < dense_calls && !recorder_->writes_behind()) unlooked_ = calls_unlooked;
  write([&] { return recorder_->commit_if_due(wall_); });
}

namespace {

using nlohmann::json;

void journal(TrialRecording& recording, const DeviceLogEntry& line) {
  const json payload{{"device", line.device},
                     {"level", line.level == LogLevel::error ? "error" : "warning"},
                     {"text", line.text}};
  // A device's text need not be UTF-8.
  recording.journal(line.time, "device_log",
                    payload.dump(-1, ' ', false, json::error_handler_t::replace));
}

}  // namespace

DeviceLog::DeviceLog(Bench& bench, Loop& loop, DeviceLogSink sink)
    : bench_(&bench), sink_(std::move(sink)) {
  bench.on_log([this, &loop](LogLevel level, std::string_view device, std::string_view text) {
    if (level < LogLevel::warning) return;
    take({loop.now(), level, std::string(device), std::string(text)});
  });
}

DeviceLog::~DeviceLog() {
  bench_->on_log({});
}

void DeviceLog::take(DeviceLogEntry line) {
  if (sink_) sink_(line);
  if (recording_ != nullptr) return journal(*recording_, line);
  if (entries_.size() < most_stored) return entries_.push_back(std::move(line));
  ++dropped_;
}

void DeviceLog::journal_to(TrialRecording* recording) {
  recording_ = recording;
  if (recording_ == nullptr) return;
  for (const DeviceLogEntry& line : std::exchange(entries_, {})) journal(*recording_, line);
  if (const std::size_t lost = std::exchange(dropped_, 0); lost > 0)
    recording_->journal({}, "device_log_cut", json{{"lines", lost}}.dump());
}

}  // namespace weft::daemon
