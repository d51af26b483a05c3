#include "daemon/service/lab_agent/lab_outbox.hpp"

namespace weft::daemon::lab {
namespace {

constexpr const char* schema_sql = R"sql(
CREATE TABLE IF NOT EXISTS lab_run (
  run INTEGER PRIMARY KEY, state TEXT NOT NULL, changed_us INTEGER, revision_us INTEGER NOT NULL,
  is_published INTEGER NOT NULL
) STRICT;
CREATE INDEX IF NOT EXISTS lab_run_pending ON lab_run (revision_us) WHERE is_published = 0;
CREATE TABLE IF NOT EXISTS lab_identity (
  id INTEGER PRIMARY KEY CHECK (id = 1), instance TEXT NOT NULL, store TEXT NOT NULL
) STRICT;
INSERT OR IGNORE INTO lab_identity (id, instance, store) VALUES (1, lower(hex(randomblob(8))), '');
CREATE TABLE IF NOT EXISTS lab_part (
  id INTEGER PRIMARY KEY CHECK (id = 1), campaign INTEGER NOT NULL, number INTEGER NOT NULL,
  token TEXT NOT NULL, campaign_name TEXT NOT NULL, fabric TEXT NOT NULL,
  attempt INTEGER NOT NULL, run INTEGER NOT NULL
) STRICT;
)sql";

}  // namespace

Result<LabOutbox> LabOutbox::open(sqlite::Database& database) {
  if (Status made = database.execute(schema_sql); !made) return pass(made.error());
  return LabOutbox(database);
}

Result<std::string> LabOutbox::instance() {
  std::string out;
  const Status done = database_->each("SELECT instance FROM lab_identity",
                                      [&](const sqlite::Statement& row) { out = row.text(0); });
  if (!done) return pass(done.error());
  return out;
}

Result<bool> LabOutbox::use_store(const std::string& store) {
  std::string before;
  Status done = database_->each("SELECT store FROM lab_identity",
                                [&](const sqlite::Statement& row) { before = row.text(0); });
  if (!done) return pass(done.error());
  if (before == store) return false;
  // The runs first: after a crash between the two they are marked once more.
  done = database_->execute("UPDATE lab_run SET is_published = 0");
  if (done) done = database_->run("UPDATE lab_identity SET store = ?", store);
  if (!done) return pass(done.error());
  return !before.empty();
}

Status LabOutbox::mark(std::int64_t run, std::string_view state, bool is_over,
                       std::int64_t utc_us) {
  return database_->run(
      "INSERT INTO lab_run (run, state, changed_us, revision_us, is_published) "
      "VALUES (?1, ?2, iif(?3, NULL, ?4), ?4, 0) ON CONFLICT(run) DO UPDATE SET "
      "state = excluded.state, changed_us = ?4, is_published = 0, "
      "revision_us = max(revision_us + 1, excluded.revision_us) WHERE state <> excluded.state",
      run, state, static_cast<std::int64_t>(is_over), utc_us);
}

Result<std::vector<UnpublishedRun>> LabOutbox::pending(std::size_t most) {
  std::vector<UnpublishedRun> out;
  auto rows = database_->prepare(
      "SELECT run, revision_us, changed_us FROM lab_run WHERE is_published = 0 "
      "ORDER BY revision_us LIMIT ?");
  if (!rows) return pass(rows.error());
  const Status done =
      rows->bind_all(static_cast<std::int64_t>(most)).each([&](const sqlite::Statement& row) {
        out.push_back({row.integer(0), row.integer(1),
                       row.is_null(2) ? std::nullopt : std::optional(row.integer(2))});
      });
  if (!done) return pass(done.error());
  return out;
}

Result<std::int64_t> LabOutbox::count() {
  const auto found = database_->integer("SELECT count(*) FROM lab_run WHERE is_published = 0");
  if (!found) return pass(found.error());
  return found->value_or(0);
}

Result<bool> LabOutbox::has(std::int64_t run) {
  const auto found = database_->integer(
      "SELECT count(*) FROM lab_run WHERE is_published = 0 AND run = " + std::to_string(run));
  if (!found) return pass(found.error());
  return found->value_or(0) > 0;
}

Status LabOutbox::on_published(const UnpublishedRun& published) {
  return database_->run("UPDATE lab_run SET is_published = 1 WHERE run = ? AND revision_us <= ?",
                        published.run, published.revision_us);
}

Result<std::optional<HeldPart>> LabOutbox::part() {
  std::optional<HeldPart> out;
  const Status done = database_->each(
      "SELECT campaign, number, token, campaign_name, fabric, attempt, run FROM lab_part",
      [&](const sqlite::Statement& row) {
        out = HeldPart{{row.integer(0), row.integer(1), row.text(2)},
                       row.text(3),
                       row.text(4),
                       row.integer(5),
                       row.integer(6)};
      });
  if (!done) return pass(done.error());
  return out;
}

Status LabOutbox::set_part(const std::optional<HeldPart>& part) {
  if (!part) return database_->execute("DELETE FROM lab_part");
  return database_->run(
      "INSERT OR REPLACE INTO lab_part (id, campaign, number, token, campaign_name, fabric, "
      "attempt, run) VALUES (1, ?, ?, ?, ?, ?, ?, ?)",
      part->lease.campaign, part->lease.number, part->lease.token, part->campaign_name,
      part->fabric, part->attempt, part->run);
}

}  // namespace weft::daemon::lab
