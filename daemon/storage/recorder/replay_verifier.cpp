#include "daemon/storage/recorder/replay_verifier.hpp"

namespace weft::daemon {
namespace {

Result<Sha256Digest> recorded_rows(sqlite::Database& database, std::int64_t trial,
                                   std::int64_t stream) {
  auto query =
      database.prepare("SELECT data FROM chunk WHERE trial = ? AND stream = ? ORDER BY number");
  if (!query) return pass(query.error());
  query->bind(1, trial).bind(2, stream);
  Sha256 hash;
  while (true) {
    const auto row = query->step();
    if (!row) return pass(row.error());
    if (!*row) return hash.finish();
    hash.update(query->blob(0));
  }
}

tl::unexpected<Error> history_mismatch(std::uint32_t index, std::string_view what) {
  return fail(
      {.code = Errc::wrong_state,
       .where = "trial " + std::to_string(index + 1) + ", " + std::string(what),
       .what = "the simulated bench, played again from its seed, does not do what was recorded",
       .hint = "Go on with the version of Weft that recorded it, or begin a new campaign"});
}

}  // namespace

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
  // Somebody ends the run while the past is played: that is no part of it.
  if (outcome == TrialOutcome::aborted || outcome == TrialOutcome::stopped) return {};
  Attempts& of_trial = trials_[index_];
  if (of_trial.played >= of_trial.on_record.size() ||
      of_trial.on_record[of_trial.played].outcome != outcome)
    return history_mismatch(index_, "outcome");
  const PastAttempt& on_record = of_trial.on_record[of_trial.played];
  for (std::size_t stream = 0; stream < stream_count; ++stream) {
    const auto recorded = recorded_rows(database_, on_record.id, static_cast<std::int64_t>(stream));
    if (!recorded) return pass(recorded.error());
    if (*recorded != digests_[stream].finish())
      return history_mismatch(index_, to_string(static_cast<Stream>(stream)));
  }
  ++of_trial.played;
  ++played_;
  return {};
}

}  // namespace weft::daemon
