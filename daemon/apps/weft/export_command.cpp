// Exports for other programs: the features of a data set, and the trials of a campaign.

#include <map>
#include <nlohmann/json.hpp>

#include "classifier/features/layout.hpp"
#include "classifier/vibro/protocol.hpp"
#include "daemon/apps/weft/commands.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/evaluate_recordings.hpp"
#include "daemon/apps/weft/evaluate_text.hpp"
#include "daemon/apps/weft/options.hpp"
#include "daemon/apps/weft/trial_choice.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/storage/certificate/exports.hpp"
#include "daemon/storage/dataset/import.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

namespace vibro = classifier::vibro;

struct FeaturesArgs {
  std::filesystem::path dataset;
  std::filesystem::path out;
  TrialChoice trials;
  RecordingChoice recordings;
};
struct CampaignExportArgs {
  std::filesystem::path folder;
  std::string format = "hdf5";
  std::string exploration, stream;
};

struct Unit {
  std::string feature, unit;
};

// Units of the columns that FeatureLayout knows; it does not know those of imprints.
std::vector<Unit> units_of(const ChosenTrials& chosen) {
  std::map<std::string, std::string_view, std::less<>> known;
  const classifier::FeatureLayout layout(chosen.setup.taxels, chosen.setup.phases);
  for (const classifier::FeatureInfo& column : layout.columns()) known[column.name] = column.unit;
  std::vector<Unit> out;
  for (const std::string& name : chosen.features.names) {
    const auto at = known.find(name.substr(name.find(':') + 1));  // of "M1:range.M.4"
    if (at != known.end()) out.push_back({name, std::string(at->second)});
  }
  return out;
}

// "  count: mean.P, max.M.1 ...; count^2: var.M.1 ...", every feature by its name.
std::string units_text(const std::vector<Unit>& units) {
  std::map<std::string, std::vector<std::string>> by_unit;
  for (const Unit& one : units) by_unit[one.unit].push_back(one.feature);
  std::string out;
  for (const auto& [unit, features] : by_unit) out += "  [" + unit + "] " + joined(features) + "\n";
  return out;
}

json units_json(const std::vector<Unit>& units) {
  json out = json::object();
  for (const Unit& one : units) out[one.feature] = one.unit;
  return out;
}

void add_options(CLI::App& command, FeaturesArgs& args) {
  command.add_option("DATASET", args.dataset, "data set (HDF5)")->required();
  command.add_option("-o,--output", args.out, "write the table to this file (CSV)")->required();
  LearningOptions options(command, args.trials.modality, args.trials.given);
  add_trial_options(command, options, args.trials);
  add_level_option(command, args.trials);
  add_recording_feature_options(options, args.recordings);
  options.finish();
}

// Writes a row for every window of sound and vibration.
Result<int> run_window_features(const FeaturesArgs& args, Console& console) {
  if (auto ok = check_command(args.trials, DataKind::whole_recordings); !ok)
    return pass(ok.error(), args.dataset.string());
  auto set = open_recordings(args.dataset, args.trials.exploration, false);
  if (!set) return pass(set.error());
  const std::string sha256 = recordings_sha256(*set);
  if (auto ok = set_groups(*set, args.trials.group); !ok)
    return pass(ok.error(), args.dataset.string());
  const auto features = parse_feature_choice(args.recordings);
  if (!features) return pass(features.error());
  vibro::ProtocolOptions cut;
  cut.protocol = vibro::Protocol::groups;  // whole recordings
  cut.step_s = args.recordings.step_s;
  if (args.trials.window_s > 0.0) cut.window_s = args.trials.window_s;
  const auto windows =
      vibro::cut_and_extract(set->recordings, cut.window_s, vibro::places_of(cut), *features);
  if (!windows) return pass(windows.error(), args.dataset.string());
  if (auto ok = export_features_csv(args.out, windows->matrix, {}); !ok) return pass(ok.error());
  const std::size_t columns = windows->matrix.names.size();
  print(console,
        bench_banner(set->kind) + args.out.string() + ": " + thousands(windows->matrix.size()) +
            " windows of " + std::to_string(columns) + " features\n" +
            (windows->too_short.empty() ? "" : format_too_short(windows->too_short) + "\n"),
        {{"command", "features"},
         {"file", args.out.string()},
         {"bench", to_string(set->kind)},
         {"dataset_sha256", sha256},
         {"rows", windows->matrix.size()},
         {"recordings", set->recordings.size()},
         {"too_short", too_short_json(windows->too_short)},
         {"window_s", cut.window_s},
         {"step_s", cut.step_s},
         {"features", columns}});
  return exit_ok;
}

Result<int> run_features(const FeaturesArgs& args, Console& console) {
  if (auto ok = check_output(args.dataset, args.out); !ok) return pass(ok.error());
  if (is_about_recordings(args.trials, args.dataset, false))
    return run_window_features(args, console);
  const Result<ChosenTrials> chosen = load_trials(args.dataset, args.trials, false, true);
  if (!chosen) return pass(chosen.error());
  if (auto ok = export_features_csv(args.out, chosen->features,
                                    factor_columns(chosen->dataset, chosen->features));
      !ok)
    return pass(ok.error());
  const std::vector<Unit> units = units_of(*chosen);
  const BenchKind kind = chosen->dataset.info.kind;
  const std::size_t rows = chosen->features.size();
  const std::size_t columns = chosen->features.names.size();
  print(console,
        bench_banner(chosen->dataset.info) + args.out.string() + ": " + std::to_string(rows) +
            " rows of " + std::to_string(columns) + " features\n" + units_text(units),
        {{"command", "features"},
         {"file", args.out.string()},
         {"bench", to_string(kind)},
         {"dataset_sha256", chosen->sha256},
         {"rows", rows},
         {"strokes", chosen->strokes},
         {"features", columns},
         {"units", units_json(units)}});
  return exit_ok;
}

std::string format_text(const ExportedFile& made, const std::filesystem::path& file) {
  Table facts(Align::left);
  facts.row({"file", file.string()});
  facts.row({"trials", std::to_string(made.trials) + " of " + std::to_string(made.planned)});
  facts.row({"bytes", std::to_string(made.bytes)});
  facts.row({"sha256", made.sha256});
  facts.row({"bench", made.bench});
  return "Exported:\n" + facts.text();
}

void add_options(CLI::App& command, CampaignExportArgs& args) {
  command
      .add_option("FOLDER", args.folder,
                  "campaign folder, complete or not; the file goes to FOLDER/export")
      ->required()
      ->check(CLI::ExistingDirectory);
  add_keyword(command, "--format", args.format, {"hdf5", "features-csv", "samples-csv"},
              "write this format: data set, table of features or samples of one stream");
  const auto& streams = sample_stream_names();
  add_keyword(command, "--stream", args.stream, {streams.begin(), streams.end()},
              "write the samples of this stream, with samples-csv");
  command.add_option("--exploration", args.exploration,
                     "write the features of this exploration, with features-csv");
}

Result<int> run_campaign_export(const CampaignExportArgs& args, Console& console) {
  const ExportFormat format = export_format_from(args.format).value_or(ExportFormat::hdf5);
  if (format != ExportFormat::features_csv && !args.exploration.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = "--exploration",
                 .what = "option needs --format features-csv",
                 .expected = "--format features-csv",
                 .got = args.exploration});
  const auto stream = sample_stream_from(args.stream);
  if (stream.has_value() != (format == ExportFormat::samples_csv))
    return fail({.code = Errc::invalid_argument,
                 .where = "--stream",
                 .what = "--stream and --format samples-csv need each other",
                 .expected = joined(sample_stream_names()),
                 .got = args.stream});
  const auto made =
      export_campaign(args.folder, {format, args.exploration, stream.value_or(Stream::taxel)});
  if (!made) return pass(made.error());
  const auto file = args.folder / export_folder_name / made->name;
  print(console, format_text(*made, file),
        {{"command", "export"},
         {"file", file.string()},
         {"format", to_string(format)},
         {"bytes", made->bytes},
         {"sha256", made->sha256},
         {"dataset_sha256", made->dataset_sha256},
         {"bench", made->bench},
         {"trials", made->trials},
         {"trials_planned", made->planned}});
  return exit_ok;
}

}  // namespace

CLI::App* add_features_command(const CommandGroup& group, CommandModality modality) {
  FeaturesArgs preset;
  preset.trials.modality = modality;
  return group.add<FeaturesArgs>("features", run_features, preset);
}

void add_export_command(const CommandGroup& weft) {
  weft.add<CampaignExportArgs>("export", run_campaign_export);
}

}  // namespace weft::daemon::cli
