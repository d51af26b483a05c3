#pragma once
// The past of a simulated campaign played again: each trial is compared with what was recorded.

#include <array>

#include "daemon/dataset/sha256.hpp"
#include "daemon/recorder/campaign_past.hpp"
#include "daemon/recorder/chunk.hpp"
#include "daemon/recorder/sqlite.hpp"

namespace weft::daemon {

class PlayedAgain {
 public:
  /// Until trial `first_live` begins.
  static Result<PlayedAgain> open(const std::filesystem::path& path, const CampaignPast& past,
                                  std::uint32_t first_live);

  [[nodiscard]] bool covers(std::uint32_t index) const { return index < first_live_; }
  /// Whether every trial of the past has been played.
  [[nodiscard]] bool whole() const { return played_ == first_live_; }
  void begin(std::uint32_t index);
  void hear(Stream stream, ByteView rows);
  /// Errors: wrong_state, naming trial and stream, when this is not what was recorded.
  Status end(TrialOutcome outcome);

 private:
  PlayedAgain(sqlite::Database database, std::uint32_t first_live)
      : database_(std::move(database)), first_live_(first_live) {}

  sqlite::Database database_;
  std::uint32_t first_live_;
  std::map<std::uint32_t, PastAttempt> told_;  ///< the attempt that counted, by trial
  std::uint32_t index_ = 0;
  std::uint32_t played_ = 0;
  std::array<Sha256, stream_count> heard_;
};

}  // namespace weft::daemon
