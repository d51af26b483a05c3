#include "daemon/storage/recorder/campaign_history.hpp"

#include <algorithm>

#include "daemon/storage/recorder/log_check.hpp"
#include "daemon/storage/recorder/sqlite.hpp"

namespace weft::daemon {
namespace {

Result<std::vector<PastAttempt>> load_attempts(sqlite::Database& database) {
  auto query = database.prepare("SELECT id, plan_index, attempt, outcome FROM trial ORDER BY id");
  if (!query) return pass(query.error());
  std::vector<PastAttempt> out;
  while (true) {
    const auto row = query->step();
    if (!row) return pass(row.error());
    if (!*row) return out;
    out.push_back({query->integer(0), static_cast<std::uint32_t>(query->integer(1)),
                   static_cast<std::uint32_t>(query->integer(2)),
                   query->is_null(3) ? std::nullopt : trial_outcome_from(query->text(3))});
  }
}

/// Whether a line of the journal says that the bench's clock went another way.
bool disturbs(const JournalEntry& entry) {
  if (entry.kind == "resumed")
    return entry.payload_json.find("\"plays_again\":true") == std::string::npos;
  if (entry.kind == fault_kind) return true;
  if (entry.kind != "order") return false;
  return entry.payload_json.find("\"pause") != std::string::npos ||
         entry.payload_json.find("\"resume\"") != std::string::npos;
}

}  // namespace

std::size_t CampaignHistory::complete() const {
  return static_cast<std::size_t>(std::count_if(
      attempts.begin(), attempts.end(),
      [](const PastAttempt& attempt) { return attempt.outcome && is_done(*attempt.outcome); }));
}

std::size_t CampaignHistory::ended_early() const {
  return static_cast<std::size_t>(std::count_if(
      attempts.begin(), attempts.end(),
      [](const PastAttempt& attempt) { return attempt.outcome == TrialOutcome::ended_early; }));
}

std::size_t CampaignHistory::rejected() const {
  return static_cast<std::size_t>(std::count_if(
      attempts.begin(), attempts.end(),
      [](const PastAttempt& attempt) { return attempt.outcome == TrialOutcome::rejected; }));
}

std::uint32_t CampaignHistory::rejected_of(std::uint32_t index) const {
  return static_cast<std::uint32_t>(
      std::count_if(attempts.begin(), attempts.end(), [index](const PastAttempt& attempt) {
        return attempt.index == index && attempt.outcome == TrialOutcome::rejected;
      }));
}

std::uint32_t CampaignHistory::first_left(bool carries_on) const {
  if (attempts.empty()) return 0;
  const PastAttempt& last = attempts.back();
  // In a campaign that has come to its end before its last trial, the trial that failed ended it.
  const bool let_be = carries_on && last.outcome == TrialOutcome::failed &&
                      (!progress.finished || last.index + 1 == progress.planned);
  const bool done = last.outcome && is_done(*last.outcome);
  return done || let_be ? last.index + 1 : last.index;
}

std::map<std::uint32_t, std::uint32_t> CampaignHistory::next_attempts() const {
  std::map<std::uint32_t, std::uint32_t> next;
  for (const PastAttempt& attempt : attempts)
    next[attempt.index] = std::max(next[attempt.index], attempt.attempt + 1);
  return next;
}

Result<CampaignHistory> load_history(const std::filesystem::path& path) {
  CampaignHistory history;
  auto header = load_header(path);
  if (!header) return pass(header.error());
  history.info = std::move(header->info);
  history.taxels = header->taxels;
  const auto progress = load_progress(path);
  if (!progress) return pass(progress.error());
  history.progress = *progress;
  auto database = sqlite::Database::open(path, sqlite::Mode::read_only);
  if (!database) return pass(database.error());
  auto attempts = load_attempts(*database);
  if (!attempts) return pass(attempts.error(), path.string());
  history.attempts = std::move(*attempts);
  const auto journal = load_journal(path);
  if (!journal) return pass(journal.error());
  history.disturbed = std::any_of(journal->begin(), journal->end(), disturbs);
  return history;
}

bool is_blank_campaign(const std::filesystem::path& path) {
  const auto log = read_log(path);
  if (!log || log->damage || log->transactions > 0) return false;
  std::error_code none;
  if (std::filesystem::file_size(path, none) == 0 && !none) return log->bytes == 0;
  auto database = sqlite::Database::open(path, sqlite::Mode::read_only);
  if (!database) return false;
  auto tables = database->prepare("SELECT count(*) FROM sqlite_schema");
  if (!tables) return false;
  const auto row = tables->step();
  return row && *row && tables->integer(0) == 0;
}

Result<bool> expects_log(const std::filesystem::path& path) {
  auto database = sqlite::Database::open(path, sqlite::Mode::read_only);
  if (!database) return pass(database.error());
  auto known = database->prepare("SELECT count(*) FROM sqlite_schema WHERE name = 'log_expected'");
  if (!known) return pass(known.error(), path.string());
  const auto table = known->step();
  if (!table) return pass(table.error(), path.string());
  if (!*table || known->integer(0) == 0) return false;  // from before there was the table
  auto query = database->prepare("SELECT expected FROM log_expected");
  if (!query) return pass(query.error(), path.string());
  const auto row = query->step();
  if (!row) return pass(row.error(), path.string());
  return *row && query->integer(0) != 0;
}

}  // namespace weft::daemon
