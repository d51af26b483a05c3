#include "daemon/apps/weft/kind_options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string_view>
#include <vector>

#include "daemon/base/text/format.hpp"

namespace weft::daemon::cli {
namespace {

using Kinds = unsigned;  // DataKind's bits

constexpr Kinds bit(DataKind kind) {
  return static_cast<Kinds>(kind);
}

constexpr Kinds for_slides = bit(DataKind::slides);
constexpr Kinds for_imprints = bit(DataKind::imprints);
constexpr Kinds for_fabrics = for_slides | for_imprints;
constexpr Kinds for_random = bit(DataKind::random_windows);
constexpr Kinds for_cut = bit(DataKind::parts) | for_random;
constexpr Kinds for_recordings = for_cut | bit(DataKind::whole_recordings);
constexpr Kinds for_even_steps = for_recordings & ~for_random;
constexpr Kinds for_all = for_fabrics | for_recordings;

struct Instead {
  Kinds kinds = 0;
  std::string_view take;
};

struct OptionRow {
  std::string_view option;
  Kinds kinds = 0;  // that it says something about
  std::vector<Instead> instead = {};
};

// A slide may have been heard: then its sound and vibration can be asked about.
constexpr Instead if_vibration{for_slides, "--method with it"};

const std::vector<OptionRow>& options_by_kind() {
  static const std::vector<OptionRow> rows = {
      {"DATASET", for_all},
      {"DATA", for_all},
      {"--help", for_all},
      {"--output", for_all},
      {"--report", for_all},
      {"--seed", for_all},
      {"--threads", for_all},
      {"--train-groups", for_all},
      {"--test-groups", for_all},
      {"--leave-one-group-out", for_all},
      {"--predict", for_all},
      {"--accuracy", for_all},
      {"--most", for_all},
      {"--first", for_all},
      {"--strokes", for_all},
      {"--draws", for_all},
      {"--resamples", for_all},
      {"--window-s", for_slides | for_recordings},
      {"--window-step-s",
       for_slides,
       {{for_even_steps, "--step-s"}, {for_random, "--per-recording"}}},
      {"--exploration", for_slides | for_recordings},
      {"--norm", for_slides},
      {"--remove-level", for_slides},
      {"--live", for_slides},
      {"--scales", for_imprints},
      {"--imprint-features", for_imprints, {{for_recordings, "--features"}}},
      {"--learner", for_fabrics, {{for_recordings, "--method"}}},
      {"--train-fraction", for_fabrics, {{for_cut, "--protocol"}}},
      {"--repeats", for_fabrics | for_random},
      {"--permute-labels", for_fabrics},
      {"--none-of-these", for_fabrics},
      {"--learning-curve", for_fabrics},
      {"--curve-draws", for_fabrics},
      {"--calibration", for_fabrics},
      {"--answers", for_fabrics},
      {"--cap", for_fabrics},
      {"--folds", for_fabrics},
      {"--fold-unit", for_fabrics},
      {"--paper-selection", for_fabrics},
      {"--t-test", for_fabrics},
      {"--solver", for_fabrics},
      {"--tie", for_fabrics},
      {"--method", for_recordings},
      {"--importance", for_recordings},
      {"--features", for_recordings, {{for_imprints, "--imprint-features"}, if_vibration}},
      {"--combine", for_recordings, {if_vibration}},
      {"--components", for_recordings, {if_vibration}},
      {"--step-s",
       for_even_steps,
       {{for_slides, "--window-step-s"}, {for_random, "--per-recording"}}},
      {"--protocol", for_cut, {if_vibration}},
      {"--blocks", bit(DataKind::parts), {if_vibration}},
      {"--per-recording", for_random, {if_vibration}},
  };
  return rows;
}

std::string_view describe_kind(DataKind kind) {
  switch (kind) {
    case DataKind::slides:
      return "slides over a tactile array";
    case DataKind::imprints:
      return "imprints, which stand still";
    case DataKind::parts:
      return "recordings of sound and vibration in contiguous parts";
    case DataKind::random_windows:
      return "windows at random of recordings of sound and vibration";
    case DataKind::whole_recordings:
      return "whole recordings of sound and vibration";
  }
  return {};
}

}  // namespace

void record_given(CLI::App& command, GivenOptions& given) {
  for (CLI::Option* option : command.get_options())
    option->each([&given, name = option->get_name()](const std::string&) { given.insert(name); });
}

Status check_given(const GivenOptions& given, DataKind kind) {
  std::vector<std::string> refused, instead;
  for (const std::string& option : given) {
    const auto row = std::ranges::find(options_by_kind(), option, &OptionRow::option);
    if (row != options_by_kind().end() && (row->kinds & bit(kind)) != 0) continue;
    refused.push_back(option);
    if (row == options_by_kind().end()) continue;
    for (const Instead& other : row->instead)
      if ((other.kinds & bit(kind)) != 0)
        instead.push_back("for " + option + " take " + std::string(other.take));
  }
  if (refused.empty()) return {};
  std::string hint = joined(instead);
  if (!hint.empty()) hint.front() = 'F';
  return fail({.code = Errc::invalid_argument,
               .where = joined(refused),
               .what = "not for " + std::string(describe_kind(kind)),
               .hint = hint});
}

}  // namespace weft::daemon::cli
