#include "daemon/storage/recorder/campaign_history.hpp"

#include <algorithm>

namespace weft::daemon {
namespace {

/// True if a journal entry shows that the bench clock was disturbed.
bool disturbs(const JournalEntry& entry) {
  if (entry.kind == "resumed")
    return entry.payload_json.find("\"plays_again\":true") == std::string::npos;
  if (entry.kind == fault_kind) return true;
  if (entry.kind != "order") return false;
  return entry.payload_json.find("\"pause") != std::string::npos ||
         entry.payload_json.find("\"resume\"") != std::string::npos;
}

tl::unexpected<Error> history_mismatch(std::uint32_t index, std::string_view what) {
  return fail({.code = Errc::wrong_state,
               .where = "trial " + std::to_string(index + 1) + ", " + std::string(what),
               .what = "replay differs from the recording",
               .hint = "Resume with the Weft version that recorded it, or start a new campaign"});
}

}  // namespace

std::size_t CampaignHistory::count_of(TrialOutcome outcome) const {
  return static_cast<std::size_t>(
      std::ranges::count(attempts, std::optional(outcome), &PastAttempt::outcome));
}

std::size_t CampaignHistory::complete() const {
  return count_of(TrialOutcome::complete) + ended_early();
}

std::uint32_t CampaignHistory::rejected_of(std::uint32_t index) const {
  return static_cast<std::uint32_t>(
      std::ranges::count_if(attempts, [index](const PastAttempt& attempt) {
        return attempt.index == index && attempt.outcome == TrialOutcome::rejected;
      }));
}

std::uint32_t CampaignHistory::first_left(bool carries_on) const {
  if (attempts.empty()) return 0;
  const PastAttempt& last = attempts.back();
  // In a campaign that ended before its last trial, the failed trial caused that end.
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
  const Status done =
      database->each("SELECT id, plan_index, attempt, outcome FROM trial ORDER BY id",
                     [&](const sqlite::Statement& row) {
                       history.attempts.push_back(
                           {row.integer(0), static_cast<std::uint32_t>(row.integer(1)),
                            static_cast<std::uint32_t>(row.integer(2)),
                            row.is_null(3) ? std::nullopt : trial_outcome_from(row.text(3))});
                     });
  if (!done) return pass(done.error(), path.string());
  const auto journal = load_journal(path);
  if (!journal) return pass(journal.error());
  history.disturbed = std::ranges::any_of(*journal, disturbs);
  return history;
}

Result<ReplayVerifier> ReplayVerifier::open(const std::filesystem::path& path,
                                            const CampaignHistory& history,
                                            std::uint32_t first_live) {
  auto database = sqlite::Database::open(path, sqlite::Mode::read_only);
  if (!database) return pass(database.error());
  ReplayVerifier verifier(std::move(*database));
  std::map<std::uint32_t, PastAttempt> last;
  for (const PastAttempt& attempt : history.attempts) {
    last[attempt.index] = attempt;
    if (attempt.outcome == TrialOutcome::rejected)
      verifier.trials_[attempt.index].on_record.push_back(attempt);
  }
  for (const auto& [index, attempt] : last)
    if (index < first_live && attempt.outcome != TrialOutcome::rejected)
      verifier.trials_[index].on_record.push_back(attempt);
  for (const auto& [index, of_trial] : verifier.trials_)
    verifier.attempts_ += of_trial.on_record.size();
  return verifier;
}

bool ReplayVerifier::covers(std::uint32_t index) const {
  const auto of_trial = trials_.find(index);
  return of_trial != trials_.end() && of_trial->second.played < of_trial->second.on_record.size();
}

void ReplayVerifier::begin(std::uint32_t index) {
  index_ = index;
  digests_ = {};
}

void ReplayVerifier::on_rows(Stream stream, ByteView rows) {
  digests_[static_cast<std::size_t>(stream)].update(rows);
}

Status ReplayVerifier::end(TrialOutcome outcome) {
  // A user ended the run during the replay; that end is not part of the record.
  if (outcome == TrialOutcome::aborted || outcome == TrialOutcome::stopped) return {};
  Attempts& of_trial = trials_[index_];
  if (of_trial.played >= of_trial.on_record.size() ||
      of_trial.on_record[of_trial.played].outcome != outcome)
    return history_mismatch(index_, "outcome");
  const PastAttempt& on_record = of_trial.on_record[of_trial.played];
  for (std::size_t stream = 0; stream < stream_count; ++stream) {
    auto chunks =
        database_.prepare("SELECT data FROM chunk WHERE trial = ? AND stream = ? ORDER BY number");
    if (!chunks) return pass(chunks.error());
    Sha256 recorded;
    const Status read =
        chunks->bind_all(on_record.id, stream).each([&](const sqlite::Statement& row) {
          recorded.update(row.blob(0));
        });
    if (!read) return read;
    if (recorded.finish() != digests_[stream].finish())
      return history_mismatch(index_, to_string(static_cast<Stream>(stream)));
  }
  ++of_trial.played;
  ++played_;
  return {};
}

}  // namespace weft::daemon
