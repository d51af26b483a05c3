#pragma once
// The past of a simulated campaign played again: each trial is compared with what was recorded.

#include <array>

#include "daemon/base/file/sha256.hpp"
#include "daemon/storage/recorder/campaign_past.hpp"
#include "daemon/storage/recorder/chunk.hpp"
#include "daemon/storage/recorder/sqlite.hpp"

namespace weft::daemon {

class PlayedAgain {
 public:
  /// Until trial `first_live` begins, its rejected takes left out: they are of the past.
  static Result<PlayedAgain> open(const std::filesystem::path& path, const CampaignPast& past,
                                  std::uint32_t first_live);

  /// Whether the next take of the trial is of the past.
  [[nodiscard]] bool covers(std::uint32_t index) const;
  /// Whether every take of the past has been played.
  [[nodiscard]] bool whole() const { return played_ == takes_; }
  void begin(std::uint32_t index);
  void hear(Stream stream, ByteView rows);
  /// Errors: wrong_state, naming trial and stream, when this is not what was recorded.
  Status end(TrialOutcome outcome);

 private:
  explicit PlayedAgain(sqlite::Database database) : database_(std::move(database)) {}

  /// Takes of one trial that a run which nobody kills has too.
  struct Takes {
    std::vector<PastAttempt> told;
    std::size_t played = 0;
  };
  sqlite::Database database_;
  std::map<std::uint32_t, Takes> trials_;
  std::uint32_t index_ = 0;
  std::size_t takes_ = 0, played_ = 0;
  std::array<Sha256, stream_count> heard_;
};

}  // namespace weft::daemon
