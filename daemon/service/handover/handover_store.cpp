#include "daemon/service/handover/handover_store.hpp"

namespace weft::daemon::handover {

Result<std::map<std::int64_t, HandoverStatus>> HandoverStore::handovers() {
  auto query =
      database_->prepare("SELECT run, state, by, error, result_json, attempts FROM hand_over");
  if (!query) return pass(query.error());
  std::map<std::int64_t, HandoverStatus> out;
  for (;;) {
    const auto row = query->step();
    if (!row) return pass(row.error());
    if (!*row) return out;
    HandoverStatus fact;
    const auto state = handover_state_from(query->text(1));
    if (!state)
      return fail({.code = Errc::corrupt,
                   .where = "hand_over",
                   .what = "a hand-over in no state that there is",
                   .got = query->text(1)});
    fact.state = *state;
    fact.by = query->text(2);
    fact.error = query->text(3);
    fact.result_json = query->text(4);
    fact.attempts = static_cast<std::size_t>(query->integer(5));
    out.emplace(query->integer(0), std::move(fact));
  }
}

Status HandoverStore::persist(std::int64_t run, const HandoverStatus& fact) {
  auto change = database_->prepare_to_write(
      "INSERT OR REPLACE INTO hand_over (run, state, by, error, result_json, attempts) VALUES "
      "(?,?,?,?,?,?)");
  if (!change) return pass(change.error());
  change->bind(1, run).bind(2, to_string(fact.state)).bind(3, fact.by).bind(4, fact.error);
  change->bind(5, fact.result_json).bind(6, static_cast<std::int64_t>(fact.attempts));
  return change->run();
}

}  // namespace weft::daemon::handover
