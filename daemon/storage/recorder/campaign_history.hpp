#pragma once
// What a campaign file tells whoever goes on with it.

#include <filesystem>
#include <map>
#include <optional>
#include <vector>

#include "daemon/storage/recorder/recorder.hpp"

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

  [[nodiscard]] std::size_t complete() const;
  [[nodiscard]] std::size_t ended_early() const;  ///< of those
  /// Takes of all trials, or of one, that were bad and taken again.
  [[nodiscard]] std::size_t rejected() const;
  [[nodiscard]] std::uint32_t rejected_of(std::uint32_t index) const;
  /// The trial to go on with; `planned` when there is none left. `carries_on`: a trial that failed
  /// is not run again.
  [[nodiscard]] std::uint32_t first_left(bool carries_on) const;
  /// The number of the next attempt at each trial that was begun.
  [[nodiscard]] std::map<std::uint32_t, std::uint32_t> next_attempts() const;
};

/// Errors: load_campaign()'s.
Result<CampaignHistory> load_history(const std::filesystem::path& path);

/// A file that a process left behind before it had written anything into it or its log.
bool is_blank_campaign(const std::filesystem::path& path);

/// The file, read with its log where there is one, says that its newest rows are in a log that is
/// not there. Errors: those of SQLite.
Result<bool> expects_log(const std::filesystem::path& path);

}  // namespace weft::daemon
