#include "daemon/storage/recorder/played_again.hpp"

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

tl::unexpected<Error> another_past(std::uint32_t index, std::string_view what) {
  return fail(
      {.code = Errc::wrong_state,
       .where = "trial " + std::to_string(index + 1) + ", " + std::string(what),
       .what = "the simulated bench, played again from its seed, does not do what was recorded",
       .hint = "Go on with the version of Weft that recorded it, or begin a new campaign"});
}

}  // namespace

Result<PlayedAgain> PlayedAgain::open(const std::filesystem::path& path, const CampaignPast& past,
                                      std::uint32_t first_live) {
  auto database = sqlite::Database::open(path, sqlite::Mode::read_only);
  if (!database) return pass(database.error());
  PlayedAgain again(std::move(*database));
  std::map<std::uint32_t, PastAttempt> last;
  for (const PastAttempt& attempt : past.attempts) {
    last[attempt.index] = attempt;
    if (attempt.outcome == TrialOutcome::rejected)
      again.trials_[attempt.index].told.push_back(attempt);
  }
  for (const auto& [index, attempt] : last)
    if (index < first_live && attempt.outcome != TrialOutcome::rejected)
      again.trials_[index].told.push_back(attempt);
  for (const auto& [index, takes] : again.trials_) again.takes_ += takes.told.size();
  return again;
}

bool PlayedAgain::covers(std::uint32_t index) const {
  const auto takes = trials_.find(index);
  return takes != trials_.end() && takes->second.played < takes->second.told.size();
}

void PlayedAgain::begin(std::uint32_t index) {
  index_ = index;
  heard_ = {};
}

void PlayedAgain::hear(Stream stream, ByteView rows) {
  heard_[static_cast<std::size_t>(stream)].update(rows);
}

Status PlayedAgain::end(TrialOutcome outcome) {
  // Somebody ends the run while the past is played: that is no part of it.
  if (outcome == TrialOutcome::aborted || outcome == TrialOutcome::stopped) return {};
  Takes& takes = trials_[index_];
  if (takes.played >= takes.told.size() || takes.told[takes.played].outcome != outcome)
    return another_past(index_, "outcome");
  const PastAttempt& told = takes.told[takes.played];
  for (std::size_t stream = 0; stream < stream_count; ++stream) {
    const auto recorded = recorded_rows(database_, told.id, static_cast<std::int64_t>(stream));
    if (!recorded) return pass(recorded.error());
    if (*recorded != heard_[stream].finish())
      return another_past(index_, to_string(static_cast<Stream>(stream)));
  }
  ++takes.played;
  ++played_;
  return {};
}

}  // namespace weft::daemon
