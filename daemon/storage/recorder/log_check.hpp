#pragma once
// Checks the write-ahead log beside a campaign file frame by frame. SQLite reads a log up to the
// first damaged frame and does not report the rest. Format: SQLite's "Database File Format",
// section 4, "The Write-Ahead Log".

#include <cstdint>
#include <filesystem>
#include <optional>

#include "protocols/base/result.hpp"

namespace weft::daemon {

/// Errors: io; corrupt, with the damaged byte of the log or for a missing log, and with a hint.
Status check_wal(const std::filesystem::path& campaign);

/// A damaged frame that keeps SQLite from reading later transactions.
struct LogDamage {
  std::uint64_t at = 0;  ///< byte of the log where the damaged frame starts; 0: the log's header is
                         ///< damaged
  std::size_t transactions_lost = 0;  ///< complete ones after the damage; not known for a damaged
                                      ///< header
};

struct LogState {
  std::uint64_t bytes = 0;       ///< 0 also if there is no log
  std::size_t transactions = 0;  ///< committed, and readable by SQLite
  std::optional<LogDamage> damage;
};

/// "campaign.sqlite-wal" of "campaign.sqlite".
std::filesystem::path log_of(const std::filesystem::path& database);

/// True if a log that is not empty lies beside the file.
bool has_log(const std::filesystem::path& database);

/// An incomplete last transaction is not damage: a killed process leaves one. Errors: io.
Result<LogState> read_log(const std::filesystem::path& database);

/// True if the file, read with its log if there is one, records that its newest rows are in a log
/// that is missing. Errors: those of SQLite.
Result<bool> expects_log(const std::filesystem::path& path);

/// A campaign file without content: its process ended before it wrote anything into the file or its
/// log.
bool is_blank_campaign(const std::filesystem::path& path);

}  // namespace weft::daemon
