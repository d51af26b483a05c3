#include <nlohmann/json.hpp>

#include "daemon/api/data_files.hpp"
#include "daemon/api/parts.hpp"
#include "daemon/certificate/verify_json.hpp"

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

Outcome files_told(DataFiles& known, const control::StoredRun& run) {
  const auto files = known.list(run.folder);
  if (!files) return refused(files.error());
  json out = json::array();
  for (const DataFile& file : *files)
    out.push_back({{"name", file.name},
                   {"bytes", file.bytes},
                   {"sha256", file.sha256},
                   {"path", std::string(server::data_path) + run.id() + "/" + file.name}});
  return text_of({{"run", run.id()},
                  {"outcome", run.outcome},
                  {"dataset_sha256", run.dataset_sha256},
                  {"folder", run.folder.string()},
                  {"files", std::move(out)}});
}

void files_of_run(const Services& services, const Call& call, const rpc::Responder& respond) {
  const auto run = services.desk->get(call.params.at("run").get<std::string>());
  if (!run) return respond(refused(run.error()));
  answer_apart(services.file_errand, respond, [files = services.files, stored = run->stored] {
    return files_told(*files, stored);
  });
}

/// Of a run that nobody writes to.
void verify_run(const Services& services, const Call& call, const rpc::Responder& respond) {
  const auto run = services.desk->get(call.params.at("run").get<std::string>());
  if (!run) return respond(refused(run.error()));
  const control::RunState state = run->machine.state;
  if (state != control::RunState::ended && state != control::RunState::interrupted)
    return respond(refused({Errc::wrong_state,
                            "the run is not over",
                            "/params/run",
                            "ended or interrupted",
                            std::string(to_string(state)),
                            {}}));
  answer_apart(services.file_errand, respond,
               [files = services.files, stored = run->stored]() -> Outcome {
                 const auto report = files->verify(stored.folder);
                 if (!report) return refused(report.error());
                 json out = verify_json(*report);
                 out["run"] = stored.id();
                 return text_of(out);
               });
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
  methods.add(
      {"data.verify",
       "whether a run's campaign file, data set and hand-over are what was recorded, byte by "
       "byte",
       {},
       {},
       {{"run", ParamType::text, true, "its name, \"R-000318\""}},
       "run, holds, certified, finished, blank, trials_planned, trials_complete, attempts, "
       "lost_samples, dataset_sha256, software_version, findings: where, what, hint"},
      rpc::Handler(
          [s](const Call& call, const rpc::Responder& respond) { verify_run(*s, call, respond); }));
  methods.add({"data.get",
               "the files of a run that has ended; bytes are had by GET of `path` over HTTP, with "
               "Range, the digest as ETag",
               {},
               {},
               {{"run", ParamType::text, true, "its name, \"R-000318\""}},
               "run, outcome, dataset_sha256, folder, files: name, bytes, sha256, path"},
              rpc::Handler([s](const Call& call, const rpc::Responder& respond) {
                files_of_run(*s, call, respond);
              }));
}

void open_served_file(const Services& services, std::string_view path,
                      const std::function<void(const Result<server::ServedFile>&)>& told) {
  const std::size_t slash = path.find('/');
  const auto run = services.desk->get(path.substr(0, slash));
  if (!run) return told(pass(run.error()));
  const std::string name(slash == std::string_view::npos ? "" : path.substr(slash + 1));
  const bool taken = services.file_errand(
      [files = services.files, folder = run->stored.folder, name, told]() -> Services::Report {
        return [file = files->open(folder, name), told] { told(file); };
      },
      [told](const Error& escaped) { told(pass(escaped)); });
  if (!taken)
    told(fail(Errc::timeout, "too many files wait to be looked at", {}, {}, {}, "Ask again later"));
}

}  // namespace weft::daemon::api
