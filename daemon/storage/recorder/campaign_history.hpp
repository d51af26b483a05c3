#pragma once
// State of a campaign file, needed to resume it.

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <vector>

#include "daemon/base/file/sha256.hpp"
#include "daemon/storage/recorder/chunk.hpp"
#include "daemon/storage/recorder/recorder.hpp"
#include "daemon/storage/recorder/sqlite.hpp"

namespace weft::daemon {

struct PastAttempt {
  std::int64_t id = 0;  ///< id of its row
  std::uint32_t index = 0, attempt = 0;
  std::optional<TrialOutcome> outcome;  ///< nothing: the process died during the attempt
};

struct CampaignHistory {
  DatasetInfo info;
  std::size_t taxels = 0;
  CampaignProgress progress;
  std::vector<PastAttempt> attempts;  ///< in order of time
  /// The bench clock differs from that of an undisturbed run: there was a pause, a fault injection,
  /// or a resume without replay.
  bool disturbed = false;

  [[nodiscard]] std::size_t count_of(TrialOutcome outcome) const;
  [[nodiscard]] std::size_t complete() const;  ///< see is_done()
  [[nodiscard]] std::size_t ended_early() const { return count_of(TrialOutcome::ended_early); }
  /// Rejected attempts of all trials, or of one.
  [[nodiscard]] std::size_t rejected() const { return count_of(TrialOutcome::rejected); }
  [[nodiscard]] std::uint32_t rejected_of(std::uint32_t index) const;
  /// The trial to resume with; `planned` if none is left. `carries_on`: a failed trial is not
  /// repeated.
  [[nodiscard]] std::uint32_t first_left(bool carries_on) const;
  /// Number of the next attempt, for each trial that was begun.
  [[nodiscard]] std::map<std::uint32_t, std::uint32_t> next_attempts() const;
};

/// Errors: load_campaign()'s.
Result<CampaignHistory> load_history(const std::filesystem::path& path);

/// Replay of a simulated campaign: compares each trial with the record.
class ReplayVerifier {
 public:
  /// Covers the trials before `first_live` and all rejected attempts, including those of
  /// `first_live`.
  static Result<ReplayVerifier> open(const std::filesystem::path& path,
                                     const CampaignHistory& history, std::uint32_t first_live);

  /// True if the next attempt at the trial is on record.
  [[nodiscard]] bool covers(std::uint32_t index) const;
  /// True if every recorded attempt has been replayed.
  [[nodiscard]] bool whole() const { return played_ == attempts_; }
  void begin(std::uint32_t index);
  void on_rows(Stream stream, ByteView rows);
  /// Errors: wrong_state with trial and stream if the replay differs from the record.
  Status end(TrialOutcome outcome);

 private:
  explicit ReplayVerifier(sqlite::Database database) : database_(std::move(database)) {}

  /// Attempts at one trial that an uninterrupted run also makes.
  struct Attempts {
    std::vector<PastAttempt> on_record;
    std::size_t played = 0;
  };
  sqlite::Database database_;
  std::map<std::uint32_t, Attempts> trials_;
  std::uint32_t index_ = 0;
  std::size_t attempts_ = 0, played_ = 0;
  std::array<Sha256, stream_count> digests_;
};

}  // namespace weft::daemon
