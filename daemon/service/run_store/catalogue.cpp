#include "daemon/service/run_store/catalogue.hpp"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "daemon/base/file/read_file.hpp"
#include "daemon/base/file/sha256.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/campaign/resume.hpp"
#include "daemon/storage/recorder/campaign_folder.hpp"
#include "recipes/engine/plan.hpp"

namespace weft::daemon::runs {
namespace {

namespace fs = std::filesystem;

/// The recipe file with this digest; otherwise the file with the campaign's name.
fs::path recipe_path(const CataloguePaths& paths, const DatasetInfo& info) {
  const auto is_it = [&info](const fs::path& file) {
    const auto text = read_text_file(file, recipes::max_recipe_bytes);
    return text && sha256_hex(*text) == info.recipe_sha256;
  };
  const fs::path named = paths.recipes / fs::path(info.name + ".json").filename();
  if (is_it(named)) return named;
  std::error_code unreadable;
  for (const auto& entry : fs::directory_iterator(paths.recipes, unreadable))
    if (entry.path().extension() == ".json" && is_it(entry.path())) return entry.path();
  return named;
}

/// Fabric names separated by spaces; empty if the recipe cannot be read.
std::string fabrics_of(const std::string& recipe_json) {
  const auto recipe = nlohmann::json::parse(recipe_json, nullptr, false);
  const auto fabrics = recipe.is_object() ? recipe.value("fabrics", nlohmann::json()) : recipe;
  std::vector<std::string> names;
  for (const auto& fabric : fabrics)
    if (fabric.is_string()) names.push_back(fabric);
  return joined(names, " ");
}

/// The label that a person added to the run's folder name; the whole name of any other folder.
std::string name_of(const fs::path& folder) {
  const std::string name = folder.filename();
  if (folder_number(folder) == 0) return name;
  const std::size_t more = name.find('-', 2);
  return more == std::string::npos ? "" : name.substr(more + 1);
}

Result<bool> was_kept_partial(const fs::path& campaign) {
  const auto journal = load_journal(campaign);
  if (!journal) return pass(journal.error());
  return std::ranges::find(*journal, kept_partial_kind, &JournalEntry::kind) != journal->end();
}

void add_end(const CampaignProgress& progress, bool kept_partial, StoredRun& run) {
  run.trials_done = progress.done;
  run.trials_planned = progress.planned;
  run.state = progress.finished ? RunState::ended : RunState::interrupted;
  run.outcome = not_recorded;
  if (progress.discarded)
    run.recovered = "discard";
  else if (kept_partial)
    run.recovered = "keep-partial";
  else if (progress.finished && progress.done == progress.planned)
    run.outcome = "complete";
  if (!progress.finished || kept_partial) run.outcome = "interrupted";
  run.cleanup = run.rig_fact = not_recorded;
}

/// Contents of the catalogue.
struct Known {
  std::set<std::int64_t> numbers;
  std::map<fs::path, std::int64_t> folders;  ///< canonical
  std::int64_t next_number = 0;
};

Result<Known> load_known(RunStore& store) {
  const auto runs = store.runs();
  if (!runs) return pass(runs.error());
  const auto next = store.next_number();
  if (!next) return pass(next.error());
  Known out;
  out.next_number = *next;
  std::error_code unseen;
  for (const StoredRun& run : *runs) {
    out.numbers.insert(run.number);
    out.folders.emplace(fs::weakly_canonical(run.folder, unseen), run.number);
  }
  return out;
}

/// Gives the run its number. Errors: wrong_state, the folder is known.
Status enter(Known& known, const fs::path& data, StoredRun& run) {
  std::error_code unseen;
  const fs::path folder = fs::weakly_canonical(run.folder, unseen);
  // By its name, even if it is a link to another disk.
  const fs::path name = fs::absolute(run.folder, unseen).lexically_normal();
  const bool is_here =
      fs::weakly_canonical(name.parent_path(), unseen) == fs::weakly_canonical(data, unseen);
  const std::int64_t wanted = is_here ? folder_number(name) : 0;
  if (const auto found = known.folders.find(folder); found != known.folders.end())
    return fail({.code = Errc::wrong_state,
                 .where = run.folder,
                 .what = "folder already in the catalogue",
                 .got = run_id(found->second)});
  const bool is_free = wanted > 0 && !known.numbers.contains(wanted);
  run.number = is_free ? wanted : known.next_number++;
  known.numbers.insert(run.number);
  known.folders.emplace(folder, run.number);
  return {};
}

void add_to(RunChange& change, const FoundRun& found, std::string_view by, std::int64_t utc_us) {
  const nlohmann::json payload{{"folder", found.run.folder.string()}};
  change.runs.push_back(found.run);
  change.recipes.push_back(found.recipe);
  // A folder's name may be invalid UTF-8.
  change.journal.push_back(
      {0, utc_us, found.run.id(), "imported", std::string(by),
       payload.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)});
}

/// Adds the campaign folders below `folder` to `out`, and unreadable folders to `left_out`. A
/// campaign's own folder is not searched further, and links are not followed.
void find_campaigns(const fs::path& folder, std::vector<fs::path>& out,
                    std::vector<Error>& left_out) {
  std::error_code unreadable;
  for (fs::directory_iterator entry(folder, unreadable), end; !unreadable && entry != end;
       entry.increment(unreadable)) {
    std::error_code unseen;
    if (!entry->is_directory(unseen)) continue;
    if (fs::exists(entry->path() / campaign_file_name, unseen))
      out.push_back(entry->path());
    else if (!entry->is_symlink(unseen))
      find_campaigns(entry->path(), out, left_out);
  }
  if (!unreadable) return;
  left_out.push_back(
      {.code = Errc::io,
       .where = folder.string(),
       .what = "folder not readable",
       .got = unreadable.message(),
       .hint = "Make it readable and repeat the command; runs in it are not listed"});
}

/// Reads one number of the damaged file, if possible. SQLite reads a truncated file only with a
/// writable schema; nothing is written.
std::optional<std::int64_t> read_damaged(const fs::path& file, const char* sql) {
  auto database = sqlite::Database::open_untouched(file);
  if (!database || !database->execute("PRAGMA writable_schema=ON")) return std::nullopt;
  const auto found = database->integer(sql);
  return found ? *found : std::nullopt;
}

/// The highest run number ever given; 0 if it cannot be read.
std::int64_t highest_number_in(const fs::path& file) {
  return read_damaged(file, "SELECT max(seq) FROM sqlite_sequence WHERE name = 'run'").value_or(0);
}

/// True if the file shows that the rig was neither latched nor locked out.
bool had_free_rig(const fs::path& file) {
  return read_damaged(
             file,
             "SELECT count(*) FROM rig WHERE fact = 'latched' OR latch <> '' OR lock_user <> ''") ==
         0;
}

/// Renames the file to "weftd.sqlite.damaged-20261127T152715Z", with its log, which SQLite finds by
/// its name.
Result<fs::path> keep_aside(const fs::path& file, std::int64_t utc_us) {
  std::string time = utc_text(utc_us).substr(0, 19);
  std::erase_if(time, [](char c) { return c == '-' || c == ':'; });
  std::ranges::replace(time, ' ', 'T');
  const std::string first = file.string() + ".damaged-" + time + "Z";
  std::error_code error;
  std::string aside = first;
  for (int i = 2; fs::exists(aside, error) || fs::exists(aside + "-wal", error); ++i)
    aside = first + "-" + std::to_string(i);
  for (const char* const part : {"-wal", "-shm", "-journal", ""}) {
    if (!fs::exists(file.string() + part, error)) continue;
    fs::rename(file.string() + part, aside + part, error);
    if (error)
      return fail({.code = Errc::io,
                   .where = file.string() + part,
                   .what = "damaged file not renamed",
                   .got = error.message()});
  }
  return fs::path(aside);
}

/// Opens the catalogue if readable; otherwise renames the damaged file and makes a new one.
Result<RunStore> open_or_replace(const fs::path& file, std::int64_t utc_us, fs::path& damaged) {
  auto store = RunStore::open(file);
  if (store || !is_damage(store.error().code)) return store;
  auto aside = keep_aside(file, utc_us);
  if (!aside) return pass(aside.error());
  damaged = std::move(*aside);
  store = RunStore::open(file);
  if (!store) return store;
  if (Status ok = store->skip_numbers(highest_number_in(damaged)); !ok) return pass(ok.error());
  return store;
}

/// The runs of all folders, oldest first: of two folders with one number the older run gets it.
std::vector<FoundRun> load_all(const CataloguePaths& paths, std::vector<Error>& left_out) {
  std::vector<FoundRun> found;
  std::vector<fs::path> folders;
  find_campaigns(paths.data, folders, left_out);
  for (const fs::path& folder : folders) {
    auto run = load_found_run(folder, paths);
    if (run)
      found.push_back(std::move(*run));
    else
      left_out.push_back(std::move(run).error());
  }
  std::ranges::sort(
      found, {}, [](const FoundRun& one) { return std::pair(one.run.created_us, one.run.folder); });
  return found;
}

}  // namespace

Result<FoundRun> load_found_run(const fs::path& folder, const CataloguePaths& paths) {
  const fs::path campaign = folder / campaign_file_name;
  const auto header = load_header(campaign);
  if (!header) return pass(header.error());
  const auto lock = FolderLock::take(folder);
  if (!lock) return pass(lock.error());
  const auto progress = load_progress(campaign);
  if (!progress) return pass(progress.error());
  const auto kept_partial = was_kept_partial(campaign);
  if (!kept_partial) return pass(kept_partial.error());
  const DatasetInfo& info = header->info;
  if (const std::string sha256 = sha256_hex(info.recipe_json); sha256 != info.recipe_sha256)
    return fail({.code = Errc::corrupt,
                 .where = campaign.string(),
                 .what = "recipe does not match its digest",
                 .expected = info.recipe_sha256,
                 .got = sha256});
  FoundRun found;
  StoredRun& run = found.run;
  run.recipe = recipe_path(paths, info);
  run.rig = paths.rig;
  run.folder = fs::absolute(folder).lexically_normal();
  if (!run.folder.has_filename()) run.folder = run.folder.parent_path();  // "R-000005/"
  run.recipe_sha256 = info.recipe_sha256;
  run.seed = info.seed;
  run.name = name_of(run.folder);
  run.by = not_recorded;
  run.created_us = header->created_utc_ns / 1000;
  run.bench = to_string(info.kind);
  run.dataset_sha256 = certified_dataset(folder);
  add_end(*progress, *kept_partial, run);
  found.recipe = {info.recipe_sha256, info.recipe_json};
  run.fabrics = fabrics_of(info.recipe_json);
  return found;
}

Result<StoredRun> add_found_run(RunStore& store, const CataloguePaths& paths, FoundRun found,
                                std::string_view by, std::int64_t utc_us) {
  auto known = load_known(store);
  if (!known) return pass(known.error());
  found.run.state = RunState::ended;
  Status done = enter(*known, paths.data, found.run);
  RunChange change;
  if (done) add_to(change, found, by, utc_us);
  if (done) done = store.commit(change);
  if (!done) return pass(done.error());
  return std::move(found.run);
}

Result<RebuildReport> rebuild_catalogue(const CataloguePaths& paths, std::int64_t utc_us) {
  RebuildReport report;
  auto store = open_or_replace(paths.data / store_file_name, utc_us, report.damaged);
  if (!store) return pass(store.error());
  const auto journal = store->tail("", 1);
  if (!journal) return pass(journal.error());
  auto known = load_known(*store);
  if (!known) return pass(known.error());
  RunChange change;
  if (journal->empty()) {
    RigFacts facts{.fact = RigFact::unknown, .left_by = by_rebuild};
    report.is_latched = !report.damaged.empty() && !had_free_rig(report.damaged);
    if (report.is_latched) facts.latch = Latch{true, by_rebuild};  // only an engineer can reset it
    change.rig = RigState(std::move(facts));
  }
  for (FoundRun& found : load_all(paths, report.left_out)) {
    if (!enter(*known, paths.data, found.run)) continue;
    add_to(change, found, by_rebuild, utc_us);
    report.added.push_back(std::move(found.run));
  }
  change.journal.push_back({0, utc_us, "", "catalogue_rebuilt", by_rebuild,
                            nlohmann::json{{"added", report.added.size()}}.dump()});
  if (Status written = store->commit(change); !written) return pass(written.error());
  report.next_number = known->next_number;
  return report;
}

}  // namespace weft::daemon::runs
