#include <nlohmann/json.hpp>

#include "daemon/base/text/format.hpp"
#include "daemon/service/methods/data_files.hpp"
#include "daemon/service/methods/helpers.hpp"
#include "daemon/service/run_store/catalogue.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/certificate/exports.hpp"
#include "daemon/storage/certificate/verify.hpp"

namespace weft::daemon::api {
namespace {

/// Digest of the data set that is in the run's folder now.
const std::string& digest_of(const runs::RunView& run) {
  return run.external_resume ? run.external_resume->dataset_sha256 : run.stored.dataset_sha256;
}

json data_set_json(const runs::RunView& run) {
  const runs::StoredRun& stored = run.stored;
  if (digest_of(run).empty()) return {};
  json one{{"run", stored.id()},        {"recipe", stored.recipe.stem().string()},
           {"name", stored.name},       {"created_us", stored.created_us},
           {"outcome", stored.outcome}, {"dataset_sha256", digest_of(run)}};
  if (run.external_resume) one["campaign_since"] = run_json(run).at("campaign_since");
  if (run.handover) one["handover"] = to_string(run.handover->state);
  one["result"] = result_json(run);
  return one;
}

std::string path_of(const std::string& run, const std::string& name) {
  return std::string(server::data_path) + run + "/" + name;
}

Outcome list_files(DataFiles& known, const runs::RunView& view) {
  const runs::StoredRun& run = view.stored;
  const auto files = known.list(run.folder);
  if (!files) return refused(files.error());
  const auto exports = exports_now(run.folder);
  json out = json::array();
  for (const DataFile& file : *files)
    out.push_back({{"name", file.name},
                   {"bytes", file.bytes},
                   {"sha256", file.sha256},
                   {"path", path_of(run.id(), file.name)}});
  return format_text({{"run", run.id()},
                      {"outcome", run.outcome},
                      {"dataset_sha256", digest_of(view)},
                      {"folder", run.folder.string()},
                      {"exports", exports ? exports_json(*exports) : json::array()},
                      {"files", std::move(out)}});
}

void files_of_run(const Services& services, const Call& call, const Responder& respond) {
  const auto run = services.run_manager->get(run_of(call));
  if (!run) return respond(refused(run.error()));
  answer_in_background(services.file_background, respond,
                       [files = services.files, view = *run] { return list_files(*files, view); });
}

void verify_run(const Services& services, const Call& call, const Responder& respond) {
  const auto run = run_at_rest(services, call);
  if (!run) return respond(refused(run.error()));
  answer_in_background(services.file_background, respond,
                       [files = services.files, stored = *run]() -> Outcome {
                         const auto report = files->verify(stored.folder);
                         if (!report) return refused(report.error());
                         json out = verify_json(*report);
                         out["run"] = stored.id();
                         return format_text(out);
                       });
}

Outcome exported(const DataFiles& files, const runs::StoredRun& run, const ExportRequest& request) {
  const auto made = files.make_export(run.folder, request);
  if (!made) return refused(made.error());
  const std::string name = std::string(export_folder_name) + "/" + made->name;
  return format_text({{"run", run.id()},
                      {"format", to_string(request.format)},
                      {"name", name},
                      {"bytes", made->bytes},
                      {"sha256", made->sha256},
                      {"path", path_of(run.id(), name)},
                      {"dataset_sha256", made->dataset_sha256},
                      {"bench", made->bench},
                      {"trials", made->trials},
                      {"trials_planned", made->planned}});
}

/// Errors: invalid_argument.
Result<ExportRequest> read_export_request(const Call& call) {
  const std::string wanted = call.params.value("format", "hdf5");
  const auto format = export_format_from(wanted);
  if (!format)
    return pass(bad_param("format", "unknown format", "hdf5, features-csv or samples-csv",
                          wanted.substr(0, 100)));
  ExportRequest out{.format = *format, .exploration = call.params.value("exploration", "")};
  if (*format != ExportFormat::features_csv && !out.exploration.empty())
    return pass(bad_param("exploration", "exploration not selectable in this format",
                          "format features-csv", out.exploration.substr(0, 100)));
  const std::string name = call.params.value("stream", "");
  const auto stream = sample_stream_from(name);
  if (stream) out.stream = *stream;
  if (stream.has_value() != (*format == ExportFormat::samples_csv))
    return pass(bad_param("stream", "stream missing, or given without format samples-csv",
                          joined(sample_stream_names()), name.substr(0, 100)));
  return out;
}

void export_run(const Services& services, const Call& call, const Responder& respond) {
  const auto run = run_at_rest(services, call);
  if (!run) return respond(refused(run.error()));
  auto request = read_export_request(call);
  if (!request) return respond(refused(request.error()));
  answer_in_background(services.file_background, respond,
                       [files = services.files, stored = *run, request = std::move(*request)] {
                         return exported(*files, stored, request);
                       });
}

json devices_json(const Certificate& certificate) {
  json out = json::array();
  for (const DeviceInfo& device : certificate.devices)
    out.push_back({{"name", device.name},
                   {"driver", device.driver},
                   {"identity", json::parse(device.identity_json, nullptr, false)}});
  return out;
}

json trials_json(const Certificate& certificate, std::size_t from, std::size_t most) {
  json out = json::array();
  for (std::size_t i = from; i < certificate.trials.size() && out.size() < most; ++i) {
    const CertifiedTrial& trial = certificate.trials[i];
    json gaps = json::array();
    for (const CertifiedGap& gap : trial.gaps)
      gaps.push_back(
          {{"stream", gap.stream}, {"before_sequence", gap.before_sequence}, {"lost", gap.lost}});
    out.push_back({{"name", trial.name},
                   {"outcome", trial.outcome},
                   {"sha256", trial.sha256},
                   {"gaps", std::move(gaps)}});
  }
  return out;
}

Outcome certified(const runs::StoredRun& run, std::size_t from, std::size_t most) {
  const auto read = read_certificate(run.folder);
  if (!read) return refused(read.error());
  if (!*read)
    return refused({.code = Errc::not_found,
                    .where = run.id(),
                    .what = "run without certificate",
                    .hint = "Wait until the campaign has ended"});
  const Certificate& c = **read;
  json files = json::array(), early = json::array();
  for (const FileChecksums& file : c.files)
    files.push_back({{"name", file.name},
                     {"bytes", file.bytes},
                     {"sha256", file.sha256},
                     {"path", path_of(run.id(), file.name)}});
  for (const EndedEarly& some : c.ended_early)
    early.push_back(
        {{"label", some.label}, {"exploration", some.exploration}, {"trials", some.trials}});
  json trials = trials_json(c, from, most);
  const std::size_t next = from + trials.size();
  return format_text({{"run", run.id()},
                      {"bench", c.bench_kind},
                      {"name", c.name},
                      {"seed", c.seed},
                      {"software_version", c.software_version},
                      {"recipe_sha256", c.recipe_sha256},
                      {"rig_sha256", c.rig_sha256},
                      {"dataset_sha256", c.dataset_sha256},
                      {"trials_planned", c.trials_planned},
                      {"attempts", c.trials.size()},
                      {"ended_early", std::move(early)},
                      {"devices", devices_json(c)},
                      {"files", std::move(files)},
                      {"path", path_of(run.id(), certificate_file_name)},
                      {"trials", std::move(trials)},
                      {"next", next < c.trials.size() ? json(next) : json()}});
}

void certificate_of_run(const Services& services, const Call& call, const Responder& respond) {
  constexpr std::int64_t most_trials = 1000;
  const auto run = services.run_manager->get(run_of(call));
  if (!run) return respond(refused(run.error()));
  const auto from = read_whole_number(call, {"from", 0, 0, unbounded, "trial number out of range"});
  if (!from) return respond(refused(from.error()));
  const auto most =
      read_whole_number(call, {"most", 100, 1, most_trials, "number of trials out of range"});
  if (!most) return respond(refused(most.error()));
  answer_in_background(
      services.file_background, respond,
      [stored = run->stored, from = *from, most = *most] { return certified(stored, from, most); });
}

Outcome add_imported(const Services& services, const rpc::Caller& caller,
                     const runs::CataloguePaths& paths, const Result<runs::FoundRun>& found) {
  if (!found) return refused(found.error());
  const auto run = runs::add_found_run(*services.log, paths, *found, by(caller), services.utc_us());
  if (!run) return refused(run.error());
  services.run_manager->notify_changed(run->id(), by(caller));
  services.handovers->consider(*run, {});
  return run_outcome(services.run_manager->get(run->id()));
}

// A certificate may have megabytes, so the folder is read on another thread.
void import_folder(const Services& services, const Call& call, const Responder& respond) {
  const runs::CataloguePaths paths{services.data, services.rig, services.recipes};
  const std::string name = call.params.at("folder").get<std::string>();
  if (name.find('\0') != std::string::npos)
    return respond(refused(bad_param("folder", "invalid path", "a path without zero byte", {})));
  const std::filesystem::path folder = services.data / name;
  const bool is_taken = services.file_background(
      [s = &services, paths, folder, respond, caller = call.caller]() -> Services::Report {
        return [s, paths, respond, caller, found = load_found_run(folder, paths)] {
          respond(add_imported(*s, caller, paths, found));
        };
      },
      [respond](const Error& escaped) { respond(refused(escaped)); });
  if (!is_taken)
    respond(refused({.code = Errc::timeout,
                     .what = "too many pending requests for files",
                     .hint = "Retry later"}));
}

/// Methods for the certificate and the exports of a data set.
void add_export_methods(MethodGroup& group) {
  group.read("data.certificate",
             "get the certificate of a run: devices, files and the digests that data.verify checks",
             {run_param,
              {"from", ParamType::integer, false, "index of the first attempt (default: 0)"},
              {"most", ParamType::integer, false,
               "largest number of attempts, up to 1000 (default: 100)"}},
             "run, bench, name, seed, software_version, recipe_sha256, rig_sha256, "
             "dataset_sha256, trials_planned, attempts, ended_early, devices: name, driver, "
             "identity; files: name, bytes, sha256, path; path of the whole certificate; trials: "
             "name, outcome, sha256, gaps; next",
             certificate_of_run);
  group.change(
      "data.export",
      "export the complete trials of an ended or interrupted run to a file; fetch it with GET "
      "`path` over HTTP",
      Role::operator_,
      {run_param,
       {"format", ParamType::text, false,
        "file format (default: hdf5; hdf5: data set, features-csv: table of features, samples-csv: "
        "table of the samples of one stream)"},
       {"stream", ParamType::text, false,
        "stream of samples-csv (taxels, wrench, stages, acceleration, sound)"},
       {"exploration", ParamType::text, false,
        "exploration of features-csv; needed if the campaign has several"}},
      "run, format, name, bytes, sha256, path, dataset_sha256, bench, trials, "
      "trials_planned",
      export_run);
}

// Predictions from a run's data: the live vote during the run, the handover after it.

Outcome live(const Services& services, const Call& call) {
  const auto run = services.run_manager->get(run_of(call));
  if (!run) return refused(run.error());
  json out{{"run", run->stored.id()}, {"vote", nullptr}};
  if (run->vote) out["vote"] = vote_json(*run->vote);
  return format_text(out);
}

Outcome run_after(const Services& services, const Call& call, const Status& done) {
  if (!done) return refused(done.error());
  return run_outcome(services.run_manager->get(run_of(call)));
}

json text_or_null(const std::string& text) {
  return text.empty() ? json() : json(text);
}

void add_model_methods(MethodGroup& group) {
  group.read("classify.live",
             "get the newest live vote of a run; each vote is also an event of the topic "
             "\"vote:R-000318\"",
             {run_param},
             "run, vote: trial, fabric, exploration, repetition, slide_s, winner, probability (by "
             "label), none_of_these, model_bench, ends_slide; null before the first",
             live);
  group.change(
      "handover.start",
      "repeat the handover of a run (training and evaluation) if it failed, was cancelled or its "
      "files are damaged. A complete campaign starts its handover automatically",
      Role::operator_, {run_param}, "the run", [](const Services& services, const Call& call) {
        return run_after(services, call, services.handovers->again(run_of(call), by(call.caller)));
      });
  group.change(
      "handover.cancel", "cancel a waiting or running handover; the run and its data do not change",
      Role::operator_, {run_param}, "the run", [](const Services& services, const Call& call) {
        return run_after(services, call, services.handovers->cancel(run_of(call), by(call.caller)));
      });
}

}  // namespace

Result<runs::StoredRun> run_at_rest(const Services& services, const Call& call) {
  const auto run = services.run_manager->get(run_of(call));
  if (!run) return pass(run.error());
  const runs::RunState state = run->machine.state;
  if (state == runs::RunState::ended || state == runs::RunState::interrupted) return run->stored;
  return fail({.code = Errc::wrong_state,
               .where = "/params/run",
               .what = "run has not ended",
               .expected = "ended or interrupted",
               .got = std::string(to_string(state))});
}

json vote_json(const LiveVoteUpdate& vote) {
  // An array, because a merge patch replaces it as a whole: no label of another model remains.
  json probability = nullptr;  // a model without probabilities gives null
  for (const auto& [label, share] : vote.probability)
    probability.push_back({{"label", label}, {"probability", share}});
  return {{"trial", vote.trial},
          {"fabric", vote.fabric},
          {"exploration", vote.exploration},
          {"repetition", vote.repetition},
          {"slide_s", vote.slide_s},
          {"winner", vote.winner},
          {"probability", std::move(probability)},
          {"none_of_these", vote.none_of_these},
          {"model_bench", vote.model_bench},
          {"ends_slide", vote.ends_slide},
          {"by", "auto:live_vote"}};
}

// Always has every key, so that clients that merge changes keep no old values.
json handover_json(const HandoverStatus& fact) {
  const bool runs = fact.state == HandoverState::running;
  json out{{"state", to_string(fact.state)},
           {"by", fact.by},
           {"error", text_or_null(fact.error)},
           {"step", nullptr},
           {"steps", nullptr},
           {"what", runs ? text_or_null(fact.what) : json()},
           {"bench", nullptr},
           {"dataset_sha256", nullptr},
           {"models", nullptr},
           {"evaluations", nullptr}};
  if (runs && fact.steps > 0) {
    out["step"] = fact.step + 1;
    out["steps"] = fact.steps;
  }
  if (const json result = json::parse(fact.result_json, nullptr, false); result.is_object())
    out.update(result);
  out.erase("results");  // the run has them already
  return out;
}

json result_json(const runs::RunView& run) {
  if (!run.handover) return nullptr;
  const json result = json::parse(run.handover->result_json, nullptr, false);
  return result.is_object() ? result.value("results", json()) : json();
}

void add_data_methods(rpc::Methods& methods, const Services& services) {
  MethodGroup group(methods, services);
  group.read("data.list", "list the data sets of all runs, complete or not, in pages",
             page_params(),
             "datasets: run, recipe, name, created_us, outcome (of the run), dataset_sha256 (of "
             "the present file), campaign_since (as run.get), handover, result (as run.get); next "
             "(null: last page)",
             [](const Services& s, const Call& call) {
               return runs_page(s, call, "datasets", data_set_json);
             });
  group.read(
      "data.verify",
      "verify that the campaign file, data set and handover of a run match what was recorded, byte "
      "by byte",
      {run_param},
      "run, holds, certified, finished, blank, trials_planned, trials_complete, attempts, "
      "lost_samples, dataset_sha256, software_version, exports: name, state, trials, trials_done, "
      "trials_done_now; findings: where, what, hint",
      verify_run);
  group.read(
      "data.get",
      "list the files of an ended run; fetch their bytes with GET `path` over HTTP, with Range and "
      "the digest as ETag",
      {run_param},
      "run, outcome, dataset_sha256, folder, exports: name, state (current, outdated: the run was "
      "resumed since, discarded or missing), trials, trials_done, trials_done_now; files: "
      "name, bytes, sha256, path",
      files_of_run);
  group.change(
      "data.import",
      "add the campaign folder of a weft run to the catalogue as an ended run. The folder is not "
      "moved",
      Role::operator_,
      {{"folder", ParamType::text, true,
        "folder on the daemon's machine, absolute or relative to its data folder"}},
      "the run", import_folder);
  add_export_methods(group);
  add_model_methods(group);
}

void open_served_file(const Services& services, std::string_view path,
                      const std::function<void(const Result<server::ServedFile>&)>& callback) {
  const std::size_t slash = path.find('/');
  const auto run = services.run_manager->get(path.substr(0, slash));
  if (!run) return callback(pass(run.error()));
  const std::string name(slash == std::string_view::npos ? "" : path.substr(slash + 1));
  const bool taken = services.file_background(
      [files = services.files, folder = run->stored.folder, name, callback]() -> Services::Report {
        return [file = files->open(folder, name), callback] { callback(file); };
      },
      [callback](const Error& escaped) { callback(pass(escaped)); });
  if (!taken)
    callback(fail({.code = Errc::timeout,
                   .what = "too many files wait for verification",
                   .hint = "Retry later"}));
}

}  // namespace weft::daemon::api
