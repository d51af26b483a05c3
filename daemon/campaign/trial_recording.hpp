#pragma once
// What is recorded of a trial, and how well its force was held; warnings and errors of the drivers
// for the journal.

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "daemon/campaign/attempt_quality.hpp"
#include "daemon/hardware/rig/bench.hpp"
#include "daemon/storage/recorder/recorder.hpp"
#include "recipes/engine/engine.hpp"
#include "recipes/engine/plan.hpp"

namespace weft::daemon {

/// Force error against the set point over the wrench samples of one phase.
struct ForceTally {
  std::size_t samples = 0;
  std::size_t in_band = 0;
  double sum_squares_n2 = 0;
  double worst_n = 0;
  void add(double error_n, double band_n);
  [[nodiscard]] double rms_n() const;
};

/// Normal force of a phase of rest, S or E, once what the probe brought along has died away.
class RestTally {
 public:
  void add(double force_n);
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] double mean_n() const { return mean_n_; }
  /// Of the mean, a standard deviation.
  [[nodiscard]] double error_n() const;

 private:
  std::size_t count_ = 0;
  double mean_n_ = 0, squares_n2_ = 0;  ///< of the deviations from the mean
};

struct PhaseStart {
  Phase phase = Phase::none;
  TimePoint at{};
};

/// Routes samples of the open trial into the recorder. A failed write is kept as `error()`.
class TrialRecording {
 public:
  TrialRecording(Recorder& recorder, const recipes::Plan& plan);

  void begin(std::size_t trial, TimePoint now);
  void set_phase(Phase phase, TimePoint now);
  /// `device`: the name of the one that it is of.
  void sensor(const Sample& sample, std::string_view device);
  void stages(const Snapshot& snapshot, TimePoint now);
  /// `ended_early`: complete, but for its slide.
  void end(recipes::Outcome outcome, bool ended_early, TimePoint now);
  void journal(TimePoint now, std::string_view kind, std::string_view payload_json);
  /// Lets the recorder commit when its budget of wall time is used up.
  void commit_if_due();

  /// Free bytes where the campaign is recorded, looked at once in a second of wall time.
  [[nodiscard]] std::optional<std::uint64_t> free_bytes();

  [[nodiscard]] Phase phase() const { return phase_; }
  [[nodiscard]] const std::optional<Error>& error() const { return error_; }
  /// Why the record of the trial, whose last phase is over, is bad; nothing where it is good or the
  /// recipe does not ask.
  [[nodiscard]] const std::optional<Error>& trial_bad() const { return trial_bad_; }
  /// Phase M of the trial that ended last, and of all complete trials together.
  [[nodiscard]] const ForceTally& trial_force() const { return trial_force_; }
  /// Phase S or E of the newest trial.
  [[nodiscard]] const RestTally& rest(Phase phase) const {
    return phase == Phase::end ? rest_after_ : rest_before_;
  }
  [[nodiscard]] const ForceTally& campaign_force() const { return campaign_force_; }
  /// Samples of the campaign's phases that were lost before the daemon got them [count].
  [[nodiscard]] std::uint64_t frames_lost() const { return frames_lost_; }
  /// As Recorder has it [s].
  [[nodiscard]] std::optional<double> commit_lag_s();
  /// When the taxel samples of the last trial that are recorded arrived.
  [[nodiscard]] const std::vector<TimePoint>& sampled() const { return sampled_; }
  /// And its samples of the force.
  [[nodiscard]] const std::vector<TimePoint>& wrench_sampled() const { return wrench_sampled_; }
  /// Begins of the last trial's phases; `none` where nothing is recorded.
  [[nodiscard]] const std::vector<PhaseStart>& phases() const { return phases_; }
  /// Wall seconds spent in the recorder, estimated as in TimedLoop.
  [[nodiscard]] double seconds() const;

 private:
  template <class Write>
  void write(Write&& write);
  void tally(double force_n, TimePoint at);

  Recorder* recorder_;
  const recipes::Plan* plan_;
  Phase phase_ = Phase::none;
  std::size_t trial_ = 0;
  std::map<std::size_t, std::uint32_t> attempts_;  ///< of each trial so far
  std::uint32_t stage_sequence_ = 0;
  std::optional<AttemptQualityCheck> quality_check_;
  std::optional<Error> trial_bad_;
  TimePoint phase_began_{};
  RestTally rest_before_, rest_after_;  ///< phases S and E
  ForceTally trial_force_;
  ForceTally campaign_force_;
  std::optional<Error> error_;
  std::optional<std::uint64_t> free_bytes_;
  std::chrono::nanoseconds space_seen_{};
  std::chrono::nanoseconds wall_{};  ///< monotonic, when commit_if_due() last looked
  unsigned unlooked_ = 0;            ///< calls of it that are left without a look
  std::uint64_t frames_lost_ = 0;
  unsigned writes_ = 0;
  std::chrono::nanoseconds spent_{};
  std::vector<TimePoint> sampled_, wrench_sampled_;
  std::vector<PhaseStart> phases_;
};

// What drivers say in words: warnings and errors, for the campaign's journal and for a person.

struct DeviceLogEntry {
  TimePoint time;  ///< on the bench's clock
  LogLevel level = LogLevel::warning;
  std::string device;
  std::string text;
};
using DeviceLogSink = std::function<void(const DeviceLogEntry&)>;

/// Listens to all devices of a bench, which outlives it. Each warning and error goes to the sink at
/// once, and to the journal (kind "device_log") as soon as there is one: lines from before are
/// kept, up to `most_stored`, and how many more there were is journalled too.
class DeviceLog {
 public:
  static constexpr std::size_t most_stored = 256;

  DeviceLog(Bench& bench, Loop& loop, DeviceLogSink sink);
  ~DeviceLog();
  DeviceLog(const DeviceLog&) = delete;
  DeviceLog& operator=(const DeviceLog&) = delete;

  /// A line of no device.
  void add(DeviceLogEntry line) { take(std::move(line)); }
  /// Null: lines are kept again.
  void journal_to(TrialRecording* recording);

 private:
  void take(DeviceLogEntry line);

  Bench* bench_;
  DeviceLogSink sink_;
  TrialRecording* recording_ = nullptr;
  std::vector<DeviceLogEntry> entries_;
  std::size_t dropped_ = 0;
};

}  // namespace weft::daemon
