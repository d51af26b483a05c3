#include "daemon/apps/weft/options.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "classifier/learners/learner.hpp"
#include "daemon/apps/weft/help_text.hpp"
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
  std::string_view relation = "instead of";
};

struct OptionRow {
  std::vector<std::string_view> options;
  Kinds kinds = 0;  // kinds that they have an effect on
  std::vector<Instead> instead = {};
};

/// An option with a different name in the commands of one modality.
struct OtherName {
  classifier::Modality modality;
  std::string_view of_all, own;
};
constexpr std::array other_names = {
    OtherName{classifier::Modality::fabric, "--window-step-s", "--step-s"},
    OtherName{classifier::Modality::imprint, "--imprint-features", "--features"},
    OtherName{classifier::Modality::vibro, "--method", "--learner"},
    OtherName{classifier::Modality::vibro, "--blocks", "--parts"},
};

/// Options that most users never need: --help leaves them out.
constexpr std::array<std::string_view, 20> rarely_needed = {
    "--permute-labels", "--curve-draws", "--norm",       "--remove-level",  "--cap",
    "--folds",          "--fold-unit",   "--t-test",     "--solver",        "--tie",
    "--answers",        "--combine",     "--components", "--outliers",      "--importance",
    "--noise",          "--orientation", "--threads",    "--per-recording", "--paper-selection"};

Kinds kinds_of(classifier::Modality modality) {
  switch (modality) {
    case classifier::Modality::fabric:
      return for_slides;
    case classifier::Modality::vibro:
      return for_recordings;
    case classifier::Modality::imprint:
      return for_imprints;
  }
  return for_all;
}

// A campaign may record slides with a vibration sensor too: --method selects that.
constexpr Instead if_vibration{for_slides, "--method", "with"};

const std::vector<OptionRow>& options_by_kind() {
  static const std::vector<OptionRow> rows = {
      {{"DATASET", "DATA", "--help", "--output", "--report", "--seed", "--threads", "--time-budget",
        "--help-all", "--train-groups", "--test-groups", "--leave-one-group-out", "--predict",
        "--accuracy", "--most", "--first", "--strokes", "--draws", "--resamples"},
       for_all},
      {{"--group"}, for_fabrics | bit(DataKind::whole_recordings)},
      {{"--window-s", "--exploration"}, for_slides | for_recordings},
      {{"--norm", "--remove-level", "--live"}, for_slides},
      {{"--window-step-s"},
       for_slides,
       {{for_even_steps, "--step-s"}, {for_random, "--per-recording"}}},
      {{"--scales", "--noise", "--orientation"}, for_imprints},
      {{"--imprint-features"}, for_imprints, {{for_recordings, "--features"}}},
      {{"--permute-labels", "--none-of-these", "--learning-curve", "--curve-draws", "--calibration",
        "--answers", "--cap", "--folds", "--fold-unit", "--paper-selection", "--t-test", "--solver",
        "--tie"},
       for_fabrics},
      {{"--learner"}, for_fabrics, {{for_recordings, "--method"}}},
      {{"--train-fraction"}, for_fabrics, {{for_cut, "--protocol"}}},
      {{"--repeats"}, for_fabrics | for_random},
      {{"--method", "--importance"}, for_recordings},
      {{"--features"}, for_recordings, {{for_imprints, "--imprint-features"}, if_vibration}},
      {{"--combine", "--components", "--outliers"}, for_recordings, {if_vibration}},
      {{"--step-s"},
       for_even_steps,
       {{for_slides, "--window-step-s"}, {for_random, "--per-recording"}}},
      {{"--protocol"}, for_cut, {if_vibration}},
      {{"--blocks"}, bit(DataKind::parts), {if_vibration}},
      {{"--per-recording"}, for_random, {if_vibration}},
  };
  return rows;
}

/// nullptr: unknown option.
const OptionRow* find_row(std::string_view option) {
  const auto row = std::ranges::find_if(options_by_kind(), [&](const OptionRow& one) {
    return std::ranges::find(one.options, option) != one.options.end();
  });
  return row == options_by_kind().end() ? nullptr : &*row;
}

}  // namespace

std::string_view describe_kind(DataKind kind) {
  switch (kind) {
    case DataKind::slides:
      return "strokes of a tactile array";
    case DataKind::imprints:
      return "static imprints";
    case DataKind::parts:
      return "vibration recordings in contiguous parts";
    case DataKind::random_windows:
      return "random windows of vibration recordings";
    case DataKind::whole_recordings:
      return "whole vibration recordings";
  }
  return {};
}

std::optional<std::vector<std::string>> split_names(std::string_view list) {
  std::vector<std::string> out(1);
  bool quoted = false;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const char c = list[i];
    if (quoted && c == '"' && i + 1 < list.size() && list[i + 1] == '"') {
      out.back() += list[++i];
    } else if (c == '"' && (quoted || out.back().empty())) {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      out.emplace_back();
    } else {
      out.back() += c;
    }
  }
  return quoted ? std::nullopt : std::optional(out);
}

namespace {

std::string learner_problem(const std::string& name) {
  const auto learner = classifier::learner_from(name);
  return learner ? std::string() : to_string(learner.error());
}

/// "lda", "lda,best": learners only.
bool names_learners(const std::string& word) {
  const auto names = split_names(word.ends_with(',') ? word.substr(0, word.size() - 1) : word);
  return names && std::ranges::all_of(*names, [](const std::string& name) {
           return name == "every" || classifier::learner_from(name);
         });
}

}  // namespace

CLI::Option* add_learners_option(CLI::App& command, const std::string& name,
                                 std::vector<std::string>& learners, const std::string& text) {
  return add_list(command, name, learners, text)
      ->check([](const std::string& word) { return word == "every" ? "" : learner_problem(word); })
      ->type_name("NAME,...");
}

CLI::Option* add_learner_option(CLI::App& command, const std::string& name, std::string& learner,
                                const std::string& text) {
  return command.add_option(name, learner, text)
      ->check(learner_problem)
      ->type_name("NAME")
      ->capture_default_str();
}

std::vector<std::string> join_learners(const std::vector<std::string>& words) {
  std::vector<std::string> out;
  bool is_list = false;
  for (const std::string& word : words) {
    if (is_list && names_learners(word) && !out.back().starts_with("--"))
      out.back() += (out.back().ends_with(',') ? "" : ",") + word;
    else
      out.push_back(word);
    is_list = (is_list && names_learners(word)) || word == "--learner" || word == "--method";
  }
  return out;
}

CLI::Option* add_name_list(CLI::App& command, const std::string& name,
                           std::vector<std::string>& names, const std::string& text) {
  const auto take = [&names, name](const std::vector<std::string>& lists) {
    names.clear();
    for (const std::string& list : lists) {
      const auto split = split_names(list);
      if (!split) throw CLI::ValidationError(name, "quotation mark not closed: " + list);
      names.insert(names.end(), split->begin(), split->end());
    }
  };
  return command.add_option_function<std::vector<std::string>>(name, take, text)
      ->allow_extra_args(false);
}

CLI::Validator number_range(double least, double most) {
  const CLI::Range range(least, most);
  const auto problem = [range](std::string& text) -> std::string {
    double value = 0.0;
    if (CLI::detail::lexical_cast(text, value) && std::isnan(value))
      return "Value " + text + " is not a number";
    return range(text);
  };
  return {problem, range.get_description()};
}

CLI::Option* add_number(CLI::App& command, const std::string& name, double& number, double least,
                        double most, const std::string& text) {
  return command.add_option(name, number, text)
      ->check(number_range(least, most))
      ->capture_default_str();
}

CLI::Option* add_keyword(CLI::App& command, const std::string& name, std::string& word,
                         const std::vector<std::string>& words, const std::string& text) {
  return command.add_option(name, word, text)->check(CLI::IsMember(words))->capture_default_str();
}

namespace {

bool is_for(CommandModality modality, std::string_view option) {
  const OptionRow* const row = find_row(option);
  return !modality || row == nullptr || (row->kinds & kinds_of(*modality)) != 0;
}

}  // namespace

CLI::App& LearningOptions::place_of(std::string_view option) {
  return is_for(modality_, option) ? *command_ : others_;
}

std::string name_in(CommandModality modality, std::string_view option) {
  for (const OtherName& other : other_names)
    if (modality == other.modality && option == other.of_all) return std::string(other.own);
  return std::string(option);
}

void LearningOptions::finish() {
  command_->set_help_all_flag("--help-all", "show all options, also the rarely needed ones");
  for (CLI::Option* option : command_->get_options()) {
    const std::string typed = option->get_name();
    std::string of_all = typed;
    for (const OtherName& other : other_names)
      if (modality_ == other.modality && typed == other.own) of_all = other.of_all;
    if (!is_for(modality_, of_all)) {
      command_->remove_option(option);
      continue;
    }
    option->each([given = given_, of_all, typed](const std::string&) { (*given)[of_all] = typed; });
    if (std::ranges::find(rarely_needed, typed) != rarely_needed.end())
      option->group(rarely_needed_group);
  }
}

Status check_given(const GivenOptions& given, DataKind kind) {
  std::vector<std::string> refused, instead;
  for (const auto& [option, typed] : given) {
    const OptionRow* const row = find_row(option);
    if (row != nullptr && (row->kinds & bit(kind)) != 0) continue;
    refused.push_back(typed);
    if (row == nullptr) continue;
    for (const Instead& other : row->instead)
      if ((other.kinds & bit(kind)) != 0)
        instead.push_back("use " + std::string(other.take) + " " + std::string(other.relation) +
                          " " + typed);
  }
  if (refused.empty()) return {};
  std::string hint = joined(instead);
  if (!hint.empty()) hint.front() = 'U';
  return fail({.code = Errc::invalid_argument,
               .where = joined(refused),
               .what = "option does not apply to " + std::string(describe_kind(kind)),
               .hint = hint});
}

}  // namespace weft::daemon::cli
