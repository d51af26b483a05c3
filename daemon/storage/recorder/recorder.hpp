#pragma once
// One SQLite file per campaign: catalogue, journal and sample store. Layout in docs/dataset.md.

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

/// What a run's folder calls it.
inline constexpr const char* campaign_file_name = "campaign.sqlite";

/// What a campaign file says about itself from its first byte on.
struct CampaignHeader {
  DatasetInfo info;  ///< recipe_json and rig_json as written; digests are filled in when empty
  std::size_t taxels = 16;
  std::uint32_t trials_planned = 0;
  std::int64_t created_utc_ns = 0;  ///< wall clock at the start, for people; never part of a digest
  /// The journal's first line, of kind "simulation", there as soon as the file is; empty: none. It
  /// is not read back with the header.
  std::string simulation_json = {};
};

/// When and in which order a sample arrived (the first three members of weft::Sample), and from
/// whom.
struct Stamp {
  TimePoint host;
  std::uint32_t sequence = 0;
  std::uint32_t lost = 0;     ///< samples missing right before this one
  std::string_view device{};  ///< its name, for the error of a value that cannot be recorded
};

/// Appends to one campaign file. Samples gather in buffers of fixed size and are committed as
/// chunks: when a buffer is full, at the end of a trial, and when commit_if_due() finds the budget
/// used up. A process killed at any moment leaves a readable file that lacks at most what was not
/// committed. After a failed write every further call returns that first error: nothing is dropped
/// silently.
class Recorder {
 public:
  /// Longest time that a sample may wait for its commit.
  static constexpr std::chrono::milliseconds commit_budget{100};

  /// What create() says of a path that exists; asked before a bench is moved in vain.
  static Status refuse_existing(const std::filesystem::path& path);
  /// Refuses a path that exists.
  static Result<Recorder> create(const std::filesystem::path& path, const CampaignHeader& header);

  /// How to go on with a file.
  struct Continuation {
    std::uint32_t first_trial = 0;  ///< of the plan, to be recorded
    /// The trials before it are given too, on a simulated bench that does all again: they are
    /// compared with what is on record and not written.
    bool is_replayed = false;
    std::function<Status()> before_writing = {};  ///< once, before the file changes
  };
  /// Goes on with a file that create() made. Attempts count on from those on record; what was under
  /// way is marked as interrupted. Errors: load_campaign()'s; with `is_replayed` later wrong_state,
  /// when the past is another one.
  static Result<Recorder> resume(const std::filesystem::path& path, const CampaignHistory& history,
                                 Continuation how);
  /// Whether the past is still being played; nothing has been written then.
  [[nodiscard]] bool is_replayed() const;
  /// The past is over, though no trial is left to be recorded.
  Status resume_recording(TimePoint now);

  Recorder(Recorder&&) noexcept;
  Recorder& operator=(Recorder&&) noexcept;
  ~Recorder();  ///< closes without finish(): what was not committed is lost, as with a kill

  /// From here on a thread of its own writes and commits, twice as often as the budget asks for;
  /// the calls hand over and return, so that no disk holds up a control loop. Each commit waits for
  /// the disk: a power cut costs no more than a kill. Errors come with a later call. finish() waits
  /// for all.
  void write_behind();
  [[nodiscard]] bool writes_behind() const;

  Status device(const DeviceInfo& device);

  /// Opens a trial and commits, so that the attempt is on record before anything moves.
  Status begin_trial(const TrialSpec& spec, TimePoint now);
  /// The three sample calls need an open trial and allocate nothing. Values that are not finite or
  /// beyond 2147 N, N m, mm or 21 rad are refused with Errc::range.
  Status taxel(const Stamp& stamp, const TaxelSample& sample, Phase phase);
  Status wrench(const Stamp& stamp, const WrenchSample& sample);
  /// `positions`: one per axis of the header, [m] or [rad].
  Status stages(const Stamp& stamp, std::span<const double> positions);
  /// A block of a vibration. The first of a campaign says how many readings its stream's blocks
  /// have and at which rate, and allocates; another number or rate later is refused with
  /// Errc::invalid_argument, and values beyond 2147 m/s2 or Pa or not finite with Errc::range.
  Status acceleration(const Stamp& stamp, const AccelerationSample& sample);
  Status sound(const Stamp& stamp, const SoundSample& sample);
  /// Writes what is buffered, marks the trial and commits.
  Status end_trial(TrialOutcome outcome, const TrialQuality& quality, TimePoint now);

  /// An event of the run, in or outside a trial. `payload_json` is stored as given.
  Status journal(TimePoint now, std::string_view kind, std::string_view payload_json = "{}");

  /// Call often. `steady_wall`: a monotonic wall clock of the caller (not the virtual clock), any
  /// origin.
  Status commit_if_due(std::chrono::nanoseconds steady_wall);
  Status commit();
  /// The longest time since the last call from the hand-over of a commit until it was on the disk;
  /// nothing without a commit.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> commit_lag();
  /// A sentence for people, once: another program has had the file locked for a second.
  [[nodiscard]] std::optional<std::string> take_notice();
  /// Commits, marks the campaign finished and folds the write-ahead log into the one file.
  Status finish();

  /// Where the file lies; nothing when the system does not tell.
  [[nodiscard]] std::optional<std::uint64_t> free_bytes() const;

 private:
  struct Impl;
  explicit Recorder(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// What a campaign will need on disk, with room for the write-ahead log and the HDF5 export.
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

/// Errc::io with both figures when the file system of `folder` has less than `needed_bytes` to
/// spare.
Status check_space(const std::filesystem::path& folder, std::uint64_t needed_bytes);

struct CampaignLoadOptions {
  bool all_outcomes = false;  ///< true keeps stopped, failed and interrupted trials, marked as such
  StopRequested stop_requested = {};  ///< looked at before each trial; then wrong_state
};

/// Opens a campaign file read-only, checks every chunk's CRC and gathers the trials in plan order.
/// Errors: not_found, parse (not a campaign file), corrupt (names trial, stream and chunk);
/// wrong_state, for a discarded campaign unless all outcomes are wanted.
Result<Dataset> load_campaign(const std::filesystem::path& path,
                              const CampaignLoadOptions& options = {});

/// Its header with axes and devices; no trials.
Result<CampaignHeader> load_header(const std::filesystem::path& path);

/// Whether the file begins as SQLite files do; load_campaign() tells whether it is Weft's.
bool is_campaign_file(const std::filesystem::path& path);

/// How far a campaign came; its trials tell the rest.
struct CampaignProgress {
  std::uint32_t planned = 0;  ///< trials
  bool finished = false;      ///< the run came to its end, complete or not
  bool discarded = false;     ///< somebody decided that no data set is made of it
  std::uint32_t done = 0;     ///< trials that are as the recipe wants them, see is_done()
};
/// The journal's line that says so.
inline constexpr const char* discarded_kind = "discarded";
/// The journal's line of a campaign that a person ended with the trials it had.
inline constexpr const char* kept_partial_kind = "kept_partial";
/// The journal's line of a fault that somebody let befall the bench, or of its end: what came after
/// does not come again by itself.
inline constexpr const char* fault_kind = "fault";
Result<CampaignProgress> load_progress(const std::filesystem::path& path);

/// A line of the journal.
struct JournalEntry {
  std::int64_t sequence = 0;
  TimePoint time;
  std::string kind;
  std::string payload_json;
};
Result<std::vector<JournalEntry>> load_journal(const std::filesystem::path& path);

}  // namespace weft::daemon
