#include "daemon/service/rpc/answer_store.hpp"

namespace weft::daemon::access {

Result<std::vector<StoredAnswer>> AnswerStore::answers() {
  auto query = database_->prepare(
      "SELECT name, token, fingerprint, asked_us, result, error FROM answer ORDER BY number");
  if (!query) return pass(query.error());
  std::vector<StoredAnswer> out;
  for (;;) {
    const auto row = query->step();
    if (!row) return pass(row.error());
    if (!*row) return out;
    StoredAnswer one{query->text(0), query->text(1), query->text(2), query->integer(3), {}};
    if (!query->is_null(4)) one.outcome = query->text(4);
    if (!query->is_null(5)) one.outcome = tl::unexpected(rpc::error_from_json(query->text(5)));
    out.push_back(std::move(one));
  }
}

Status AnswerStore::persist(const StoredAnswer& requested) {
  auto insert = database_->prepare_to_write(
      "INSERT OR REPLACE INTO answer (name, token, fingerprint, asked_us) VALUES (?, ?, ?, ?)");
  if (!insert) return pass(insert.error());
  insert->bind(1, requested.name).bind(2, requested.token).bind(3, requested.fingerprint);
  insert->bind(4, requested.requested_us);
  return insert->run();
}

Status AnswerStore::persist_outcome(std::string_view name, const rpc::Outcome& outcome) {
  auto change = database_->prepare_to_write(outcome ? "UPDATE answer SET result = ? WHERE name = ?"
                                                    : "UPDATE answer SET error = ? WHERE name = ?");
  if (!change) return pass(change.error());
  const std::string text = outcome ? *outcome : rpc::to_json(outcome.error());
  change->bind(1, text).bind(2, name);
  return change->run();
}

Status AnswerStore::forget_answer(std::string_view name) {
  auto change = database_->prepare_to_write("DELETE FROM answer WHERE name = ?");
  if (!change) return pass(change.error());
  change->bind(1, name);
  return change->run();
}

}  // namespace weft::daemon::access
