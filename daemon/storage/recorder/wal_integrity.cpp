#include "daemon/storage/recorder/wal_integrity.hpp"

#include "daemon/storage/recorder/campaign_history.hpp"
#include "daemon/storage/recorder/log_check.hpp"

namespace weft::daemon {
namespace {

std::string format_damage(const LogDamage& damage) {
  if (damage.at == 0) return "damaged: nothing of the log can be read";
  return "damaged: " + std::to_string(damage.transactions_lost) +
         (damage.transactions_lost == 1 ? " transaction" : " transactions") +
         " behind it cannot be read";
}

std::string hint_of(const LogState& log) {
  if (log.transactions == 0) return "Put back a copy of it; nothing was changed";
  return "Put back a copy of it; or, to go on with what lies before, keep a copy of the folder "
         "and fold the log in: sqlite3 campaign.sqlite 'PRAGMA wal_checkpoint(TRUNCATE)'";
}

}  // namespace

Status check_wal(const std::filesystem::path& campaign) {
  const std::string where = log_of(campaign).filename().string();
  const auto log = read_log(campaign);
  if (!log) return fail({.code = log.error().code, .where = where, .what = to_string(log.error())});
  if (log->damage)
    return fail({.code = Errc::corrupt,
                 .where = where + ": byte " + std::to_string(log->damage->at),
                 .what = format_damage(*log->damage),
                 .hint = hint_of(*log)});
  const auto expected = expects_log(campaign);  // what keeps it from being read is told elsewhere
  if (!expected || !*expected || log->bytes > 0) return {};
  return fail(
      {.code = Errc::corrupt,
       .where = where,
       .what =
           "the log is missing, and with it all that was recorded since it was last folded into "
           "the file",
       .hint = "Put it back: until a campaign has ended, both files are it"});
}

}  // namespace weft::daemon
