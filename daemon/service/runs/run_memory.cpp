// The runs in memory; others are read from the store on request.

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "daemon/service/runs/run_manager.hpp"

namespace weft::daemon::runs {

std::unique_ptr<RunManager::Run> RunManager::make_run(const StoredRun& stored) {
  auto run = std::make_unique<Run>();
  run->stored = stored;
  run->machine.state = stored.state;
  run->trials_done = static_cast<std::size_t>(stored.trials_done.value_or(0));
  run->trials_planned = static_cast<std::size_t>(stored.trials_planned.value_or(0));
  run->counted = stored.state != RunState::interrupted || stored.trials_done;
  return run;
}

RunManager::Run& RunManager::insert(std::unique_ptr<Run> run) const {
  const auto place = std::ranges::lower_bound(runs_, run->number(), {},
                                              [](const auto& each) { return each->number(); });
  return **runs_.insert(place, std::move(run));
}

RunManager::Run* RunManager::numbered(std::int64_t number) const {
  const auto found =
      std::ranges::find(runs_, number, [](const auto& run) { return run->number(); });
  return found == runs_.end() ? nullptr : found->get();
}

Result<RunManager::Run*> RunManager::find(std::string_view id) const {
  const std::int64_t number = run_number(id).value_or(0);
  if (Run* const known = numbered(number)) return known;
  const auto stored = store_.run(number);
  if (!stored) return pass(stored.error());
  if (*stored) return &insert(make_run(**stored));
  return fail({.code = Errc::not_found,
               .where = "/params/run",
               .what = "unknown run",
               .got = std::string(id)});
}

Result<RunView> RunManager::get(std::string_view id) const {
  const std::int64_t number = run_number(id).value_or(0);
  if (numbered(number) == nullptr)
    if (const auto stored = store_.run(number); stored && *stored)
      return shown(*make_run(**stored));
  return find(id).map([this](const Run* run) { return shown(*run); });
}

Result<RunManager::Page> RunManager::page(const RunFilter& filter,
                                          std::optional<std::int64_t> cursor,
                                          std::size_t limit) const {
  const auto stored = store_.runs(filter, cursor, limit);
  if (!stored) return pass(stored.error());
  Page out{{}, stored->next};
  for (const StoredRun& run : stored->runs) {
    const Run* const known = numbered(run.number);
    out.runs.push_back(known != nullptr ? shown(*known) : shown(*make_run(run)));
  }
  return out;
}

Result<RunView> RunManager::annotate(std::string_view id, const Annotation& wanted,
                                     std::string_view by) {
  const auto run = find(id);
  if (!run) return pass(run.error());
  StoredRun annotated = (*run)->to_store();
  annotated.tags = wanted.tags.value_or(annotated.tags);
  annotated.note = wanted.note.value_or(annotated.note);
  const nlohmann::json payload{{"tags", annotated.tags}, {"note", annotated.note}};
  if (Status ok = store_.commit(
          {.runs = {annotated}, .journal = {line(annotated.id(), "note", by, payload)}});
      !ok)
    return pass(ok.error());
  (*run)->stored.tags = annotated.tags;
  (*run)->stored.note = annotated.note;
  notify(**run, by);
  return shown(**run);
}

std::vector<RunView> RunManager::loaded() const {
  std::vector<const Run*> all;  // shown() may load the run that one follows
  for (const auto& run : runs_) all.push_back(run.get());
  std::vector<RunView> out;
  for (const Run* const run : all) out.push_back(shown(*run));
  return out;
}

void RunManager::unload_ended() {
  if (!store_.is_persisted()) return;
  std::size_t ended = 0, resumable = 0;
  std::vector<std::int64_t> unloaded;
  std::set<std::int64_t> followed;
  for (const RunQueue::Run number : queue_.runs()) followed.insert(numbered(number)->stored.after);
  for (auto each = runs_.rbegin(); each != runs_.rend(); ++each) {
    const Run& run = **each;
    if (!run.is_over()) continue;
    const bool is_new = ended++ < most_ended_loaded;
    const bool is_scanned = can_be_resumed_externally(run) && resumable++ < most_ended_loaded;
    const bool is_used = !run.waiting.empty() || executor_.run() == run.number() ||
                         followed.contains(run.number()) || recovery_.is_settling(run.number());
    if (!is_new && !is_scanned && !is_used) unloaded.push_back(run.number());
  }
  std::erase_if(runs_, [&unloaded](const auto& run) {
    return std::ranges::find(unloaded, run->number()) != unloaded.end();
  });
  for (const std::int64_t number : unloaded) context_.observer->on_run_unloaded(number);
}

}  // namespace weft::daemon::runs
