#include <nlohmann/json.hpp>

#include "daemon/api/data_files.hpp"
#include "daemon/api/parts.hpp"

namespace weft::daemon::api {
namespace {

using nlohmann::json;
using rpc::Call;
using rpc::Outcome;
using rpc::ParamType;

Outcome data_sets(const Services& services) {
  json out = json::array();
  for (const control::RunView& run : services.desk->all()) {
    const control::StoredRun& stored = run.stored;
    if (stored.dataset_sha256.empty()) continue;
    json one{{"run", stored.id()},        {"recipe", stored.recipe.stem().string()},
             {"name", stored.name},       {"created_us", stored.created_us},
             {"outcome", stored.outcome}, {"dataset_sha256", stored.dataset_sha256}};
    if (run.hand_over) one["handover"] = to_string(run.hand_over->state);
    out.push_back(std::move(one));
  }
  return text_of({{"datasets", std::move(out)}});
}

Outcome files_of_run(const Services& services, const Call& call) {
  const auto run = services.desk->get(call.params.at("run").get<std::string>());
  if (!run) return refused(run.error());
  const auto files = data_files(run->stored.folder);
  if (!files) return refused(files.error());
  json out = json::array();
  for (const DataFile& file : *files)
    out.push_back({{"name", file.name},
                   {"bytes", file.bytes},
                   {"sha256", file.sha256},
                   {"path", std::string(server::data_path) + run->stored.id() + "/" + file.name}});
  json told{{"run", run->stored.id()},
            {"outcome", run->stored.outcome},
            {"dataset_sha256", run->stored.dataset_sha256},
            {"folder", run->stored.folder.string()},
            {"files", std::move(out)}};
  return text_of(told);
}

}  // namespace

void add_data_methods(rpc::Methods& methods, const Services& services) {
  const Services* const s = &services;
  methods.add({"data.list",
               "data sets of all runs, oldest first, complete or not",
               {},
               {},
               {},
               "datasets: run, recipe, name, created_us, outcome, dataset_sha256, handover"},
              [s](const Call&) { return data_sets(*s); });
  methods.add({"data.get",
               "the files of a run that has ended; bytes are had by GET of `path` over HTTP, with "
               "Range, the digest as ETag",
               {},
               {},
               {{"run", ParamType::text, true, "its name, \"R-000318\""}},
               "run, outcome, dataset_sha256, folder, files: name, bytes, sha256, path"},
              [s](const Call& call) { return files_of_run(*s, call); });
}

}  // namespace weft::daemon::api
