#pragma once
// The past of a simulated campaign played again: each trial is compared with what was recorded.

#include <array>

#include "daemon/base/file/sha256.hpp"
#include "daemon/storage/recorder/campaign_history.hpp"
#include "daemon/storage/recorder/chunk.hpp"
#include "daemon/storage/recorder/sqlite.hpp"

namespace weft::daemon {

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
