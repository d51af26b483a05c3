#pragma once
// The write-ahead log beside a campaign file, looked at frame by frame: SQLite reads it up to the
// first frame that is damaged and says nothing about what lies behind. Format: SQLite's "Database
// File Format", section 4, "The Write-Ahead Log".

#include <cstdint>
#include <filesystem>
#include <optional>

#include "protocols/base/result.hpp"

namespace weft::daemon {

/// Errors: io; corrupt, at a byte of the log or with the log that is missing, and what to do.
Status check_wal(const std::filesystem::path& campaign);

/// Bytes that keep SQLite from reading what was committed behind them.
struct LogDamage {
  std::uint64_t at = 0;  ///< byte of the log where the damaged frame begins; 0: its header
  std::size_t transactions_lost = 0;  ///< whole ones behind it; not known for a damaged header
};

struct LogState {
  std::uint64_t bytes = 0;       ///< 0 too where there is no log
  std::size_t transactions = 0;  ///< committed, and read by SQLite
  std::optional<LogDamage> damage;
};

/// "campaign.sqlite-wal" of "campaign.sqlite".
std::filesystem::path log_of(const std::filesystem::path& database);

/// Whether a log with something in it lies beside the file.
bool has_log(const std::filesystem::path& database);

/// A last transaction that is torn is no damage: that is what a kill leaves. Errors: io.
Result<LogState> read_log(const std::filesystem::path& database);

/// The file, read with its log where there is one, says that its newest rows are in a log that is
/// not there. Errors: those of SQLite.
Result<bool> expects_log(const std::filesystem::path& path);

/// A campaign file that a process left behind before it had written anything into it or its log.
bool is_blank_campaign(const std::filesystem::path& path);

}  // namespace weft::daemon
