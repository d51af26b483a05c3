#pragma once
// The SQL part of a recorder: one open campaign file, written row by row in one transaction at a
// time. Used by one thread at a time.

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>

#include "daemon/storage/recorder/recorder.hpp"
#include "daemon/storage/recorder/sqlite.hpp"
#include "protocols/base/bytes.hpp"

namespace weft::daemon {

/// Rows of one stream, ready to be stored.
struct ChunkRecord {
  std::int64_t stream = 0;
  std::int64_t number = 0;  ///< within the trial
  std::uint32_t first_sequence = 0;
  std::uint32_t rows = 0;
  std::uint32_t lost_before = 0;
  std::int64_t t0_ns = 0;
  ByteView bytes;
};

/// Format of the rows in a stream of blocks.
struct BlockStreamRecord {
  std::int64_t stream = 0;
  BlockFormat format;
  std::int64_t axes = 1;
  const char* unit = "";
  double per_unit = 1;
};

/// After a failed write every further call returns that first error.
class CampaignWriter {
 public:
  /// Makes the file; `path` must not exist.
  static Result<std::unique_ptr<CampaignWriter>> create(const std::filesystem::path& path,
                                                        const CampaignHeader& header);

  /// Resumes writing to a file that create() made. If a killed process left a log, the writer takes
  /// it over at once. Otherwise (no log, or an empty one) the file is unchanged until
  /// begin_writing().
  static Result<std::unique_ptr<CampaignWriter>> reopen(const std::filesystem::path& path);

  /// Fails with busy if another program reads the file without a pause; changes nothing.
  Status require_no_reader();
  /// Called by the first call that writes, unless it was called before. From then on the file has a
  /// write-ahead log and expects one.
  Status begin_writing();

  /// From now on a statement waits up to 30 s for another program that has locked the file. After 1
  /// s it calls `on_wait`, on the writing thread, with a sentence that names the program.
  void wait_for_locks(std::function<void(std::string)> on_wait);
  /// From now on a commit is on the disk when it returns, so a power failure does not lose it.
  void sync_commits();

  Status device(const DeviceInfo& device);
  /// Marks unfinished attempts as interrupted (their samples are kept) and the campaign as not
  /// finished, and journals the resume.
  Status resumed(TimePoint now, std::string_view payload_json);
  /// Marks unfinished attempts as interrupted and journals the reason, for a run that is not
  /// resumed.
  Status left_behind(TimePoint now, std::string_view kind, std::string_view payload_json);
  Status begin_trial(const TrialSpec& spec, TimePoint now);  ///< also commits
  /// Before the first chunk of a stream of blocks.
  Status block_stream(const BlockStreamRecord& stream);
  Status chunk(const ChunkRecord& chunk);
  Status end_trial(TrialOutcome outcome, const TrialQuality& quality, TimePoint now);
  Status journal(TimePoint now, std::string_view kind, std::string_view payload_json);
  Status commit();
  /// Commits, marks the campaign finished and folds the write-ahead log into the file. Waits for
  /// readers. Errors: wrong_state if they still read after 30 s.
  Status finish();

 private:
  explicit CampaignWriter(sqlite::Database database) : database_(std::move(database)) {}
  Status prepare();
  Status begin();
  Status one_piece();
  /// Moves committed pages from the log into the file.
  Status fold_log();
  /// Stores the first failure.
  Status guard(Status status);
  Status place(const TrialPlace& place);
  Status rest(const RestForces& rest);

  sqlite::Database database_;
  sqlite::Statement insert_trial_, update_trial_, insert_chunk_, insert_journal_, insert_device_;
  int log_pages_ = 0;       ///< after the last commit
  std::int64_t trial_ = 0;  ///< row of the trial that was begun last
  bool can_write_ = false;
  bool in_transaction_ = false;
  std::optional<Error> failure_;
};

}  // namespace weft::daemon
