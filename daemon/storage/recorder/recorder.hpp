#pragma once
// One SQLite file per campaign: catalogue, journal and sample store. Layout in
// docs/reference/dataset.md.

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "daemon/base/file/read_file.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "drivers/api/sample.hpp"

namespace weft::daemon {

struct CampaignHistory;  // daemon/storage/recorder/campaign_history.hpp

/// Name of the campaign file in a run's folder.
inline constexpr const char* campaign_file_name = "campaign.sqlite";

/// Content of a campaign file before its first trial.
struct CampaignHeader {
  DatasetInfo info;  ///< recipe_json and rig_json as written; empty digests are computed
  std::size_t taxels = 16;
  std::uint32_t trials_planned = 0;
  std::int64_t created_utc_ns = 0;  ///< wall clock at the start, for information; not part of any
                                    ///< digest
  /// First journal entry, of kind "simulation", written together with the file; empty: none.
  /// load_header() does not return it.
  std::string simulation_json = {};
};

/// Arrival time and order of a sample (the first three members of weft::Sample), and its device.
struct Stamp {
  TimePoint host;
  std::uint32_t sequence = 0;
  std::uint32_t lost = 0;     ///< samples missing directly before this one
  std::string_view device{};  ///< device name, for the error about a value that cannot be recorded
};

/// Appends to one campaign file. Samples are collected in buffers of fixed size and committed as
/// chunks: when a buffer is full, at the end of a trial, and when commit_if_due() finds the budget
/// used up. A process killed at any moment leaves a readable file that lacks at most the
/// uncommitted samples. After a failed write every further call returns that first error: no sample
/// is dropped without an error.
class Recorder {
 public:
  /// Longest time that a sample may wait for its commit.
  static constexpr std::chrono::milliseconds commit_budget{100};

  /// The error of create() for an existing path, to be checked before the bench moves.
  static Status refuse_existing(const std::filesystem::path& path);
  /// Refuses a path that exists.
  static Result<Recorder> create(const std::filesystem::path& path, const CampaignHeader& header);

  /// Options of resume().
  struct Continuation {
    std::uint32_t first_trial = 0;  ///< first trial to record, as an index of the plan
    /// On a simulated bench the earlier trials are replayed and passed in as well; they are
    /// compared with the record and not written.
    bool is_replayed = false;
    std::function<Status()> before_writing = {};  ///< called once, before the file changes
  };
  /// Resumes a file that create() made. Attempt numbers continue from the record; unfinished
  /// attempts are marked as interrupted. Errors: load_campaign()'s; with `is_replayed`, later calls
  /// return wrong_state if the replay differs from the record.
  static Result<Recorder> resume(const std::filesystem::path& path, const CampaignHistory& history,
                                 Continuation how);
  /// True during the replay, when nothing is written.
  [[nodiscard]] bool is_replayed() const;
  /// Ends the replay, also if no trial is left to record.
  Status resume_recording(TimePoint now);

  Recorder(Recorder&&) noexcept;
  Recorder& operator=(Recorder&&) noexcept;
  ~Recorder();  ///< closes without finish(): uncommitted samples are lost, as after a kill

  /// From now on a separate thread writes and commits, twice as often as the budget requires. The
  /// calls only queue their data, so the disk cannot delay the control loop. Each commit waits for
  /// the disk, so a power failure loses no more than a kill. Errors are returned by a later call.
  /// finish() waits for all writes.
  void write_behind();
  [[nodiscard]] bool writes_behind() const;

  Status device(const DeviceInfo& device);

  /// Opens a trial and commits, so that the attempt is on record before the bench moves.
  Status begin_trial(const TrialSpec& spec, TimePoint now);
  /// taxel(), wrench() and stages() need an open trial and do not allocate. Errors: range for
  /// values that are not finite or exceed 2147 N, 2147 N m, 2147 mm or 21 rad.
  Status taxel(const Stamp& stamp, const TaxelSample& sample, Phase phase);
  Status wrench(const Stamp& stamp, const WrenchSample& sample);
  /// `positions`: one per axis of the header, [m] or [rad].
  Status stages(const Stamp& stamp, std::span<const double> positions);
  /// One block of a vibration sensor. The first block of a campaign sets the readings per block and
  /// the rate of its stream, and allocates. Errors: invalid_argument if a later block differs in
  /// these; range for values beyond 2147 m/s2 or 2147 Pa or not finite.
  Status acceleration(const Stamp& stamp, const AccelerationSample& sample);
  Status sound(const Stamp& stamp, const SoundSample& sample);
  /// Writes the buffered samples, stores outcome and quality, and commits.
  Status end_trial(TrialOutcome outcome, const TrialQuality& quality, TimePoint now);

  /// A journal entry, in or outside a trial. `payload_json` is stored unchanged.
  Status journal(TimePoint now, std::string_view kind, std::string_view payload_json = "{}");

  /// Call often. `steady_wall`: a monotonic wall clock of the caller (not the virtual clock), with
  /// any origin.
  Status commit_if_due(std::chrono::nanoseconds steady_wall);
  Status commit();
  /// The longest time since the last call between queueing a commit and its arrival on the disk;
  /// nothing without a commit.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> commit_lag();
  /// A sentence for the user, returned once, after another program has locked the file for 1 s.
  [[nodiscard]] std::optional<std::string> take_notice();
  /// Commits, marks the campaign finished and folds the write-ahead log into the file.
  Status finish();

  /// Free space on the file system of the file [bytes]; nothing if it cannot be determined.
  [[nodiscard]] std::optional<std::uint64_t> free_bytes() const;

 private:
  struct Impl;
  explicit Recorder(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Input for the disk space that a campaign needs. The result includes the write-ahead log and the
/// HDF5 export.
struct RecordingForecast {
  std::uint32_t trials = 0;
  double trial_duration_s = 0;
  std::size_t taxels = 16;
  std::size_t axes = 5;
  double taxel_rate_hz = 0;
  double wrench_rate_hz = 0;
  double stage_rate_hz = 0;
  double acceleration_rate_hz = 0;
  double sound_rate_hz = 0;
};
std::uint64_t forecast_bytes(const RecordingForecast& forecast);

/// Errors: no_space with both values if the file system of `folder` has less than `needed_bytes`
/// free; io.
Status check_space(const std::filesystem::path& folder, std::uint64_t needed_bytes);

struct CampaignLoadOptions {
  bool all_outcomes = false;  ///< true also returns trials with other outcomes, marked as such
  StopRequested stop_requested = {};  ///< checked before each trial; then wrong_state
};

/// Opens a campaign file read-only, checks every chunk's CRC and returns the trials in plan order.
/// Errors: not_found; parse (not a campaign file); unsupported (a later schema); corrupt (names
/// trial, stream and chunk); wrong_state for a discarded campaign unless `all_outcomes` is set, or
/// if stopped.
Result<Dataset> load_campaign(const std::filesystem::path& path,
                              const CampaignLoadOptions& options = {});

/// The header with axes and devices; no trials.
Result<CampaignHeader> load_header(const std::filesystem::path& path);

/// True if the file starts like an SQLite file; load_campaign() checks that it is Weft's.
bool is_campaign_file(const std::filesystem::path& path);

/// Progress of a campaign as a whole; its trials have the details.
struct CampaignProgress {
  std::uint32_t planned = 0;  ///< trials
  bool finished = false;      ///< the run ended, with all trials or not
  bool discarded = false;     ///< a user decided that no data set is made of it
  std::uint32_t done = 0;     ///< trials that need no repetition, see is_done()
};
/// Journal kind of a discarded campaign.
inline constexpr const char* discarded_kind = "discarded";
/// Journal kind of a campaign that a user ended and kept with its complete trials.
inline constexpr const char* kept_partial_kind = "kept_partial";
/// Journal kind for the start or end of a fault injection. A replay cannot reproduce what follows
/// it.
inline constexpr const char* fault_kind = "fault";
Result<CampaignProgress> load_progress(const std::filesystem::path& path);

/// One entry of the journal.
struct JournalEntry {
  std::int64_t sequence = 0;
  TimePoint time;
  std::string kind;
  std::string payload_json;
};
Result<std::vector<JournalEntry>> load_journal(const std::filesystem::path& path);

}  // namespace weft::daemon
