#pragma once
// What a campaign file tells whoever goes on with it.

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
  std::int64_t id = 0;  ///< of its row
  std::uint32_t index = 0, attempt = 0;
  std::optional<TrialOutcome> outcome;  ///< nothing: the process died under it
};

struct CampaignHistory {
  DatasetInfo info;
  std::size_t taxels = 0;
  CampaignProgress progress;
  std::vector<PastAttempt> attempts;  ///< in order of time
  /// The bench's clock ran differently than in a run that nobody touched: a pause, or a resume that
  /// did not play the past again.
  bool disturbed = false;

  [[nodiscard]] std::size_t count_of(TrialOutcome outcome) const;
  [[nodiscard]] std::size_t complete() const;  ///< see is_done()
  [[nodiscard]] std::size_t ended_early() const { return count_of(TrialOutcome::ended_early); }
  /// Takes of all trials, or of one, that were bad and taken again.
  [[nodiscard]] std::size_t rejected() const { return count_of(TrialOutcome::rejected); }
  [[nodiscard]] std::uint32_t rejected_of(std::uint32_t index) const;
  /// The trial to go on with; `planned` when there is none left. `carries_on`: a trial that failed
  /// is not run again.
  [[nodiscard]] std::uint32_t first_left(bool carries_on) const;
  /// The number of the next attempt at each trial that was begun.
  [[nodiscard]] std::map<std::uint32_t, std::uint32_t> next_attempts() const;
};

/// Errors: load_campaign()'s.
Result<CampaignHistory> load_history(const std::filesystem::path& path);

/// The past of a simulated campaign played again: each trial is compared with what was recorded.
class ReplayVerifier {
 public:
  /// Until trial `first_live` begins, its rejected takes left out: they are of the past.
  static Result<ReplayVerifier> open(const std::filesystem::path& path,
                                     const CampaignHistory& history, std::uint32_t first_live);

  /// Whether the next take of the trial is of the past.
  [[nodiscard]] bool covers(std::uint32_t index) const;
  /// Whether every take of the past has been played.
  [[nodiscard]] bool whole() const { return played_ == attempts_; }
  void begin(std::uint32_t index);
  void on_rows(Stream stream, ByteView rows);
  /// Errors: wrong_state, naming trial and stream, when this is not what was recorded.
  Status end(TrialOutcome outcome);

 private:
  explicit ReplayVerifier(sqlite::Database database) : database_(std::move(database)) {}

  /// Takes of one trial that a run which nobody kills has too.
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
