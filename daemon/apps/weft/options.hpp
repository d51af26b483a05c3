#pragma once
// How commands declare options, and which options say anything about which kind of data. For .cpp
// files: it brings CLI11.

#include <CLI/CLI.hpp>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/model/model_file.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon::cli {

/// CLI::Range of a fraction, but "nan" is refused too: it is neither below nor above anything.
CLI::Validator number_range(double least, double most);

/// A whole number in a range. Its default is shown, as are those of the next two.
template <class Count>
CLI::Option* add_count(CLI::App& command, const std::string& name, Count& count, int least,
                       int most, const std::string& text) {
  return command.add_option(name, count, text)
      ->check(CLI::Range(least, most))
      ->capture_default_str();
}
/// A number in a range.
CLI::Option* add_number(CLI::App& command, const std::string& name, double& number, double least,
                        double most, const std::string& text);
/// One of some words.
CLI::Option* add_keyword(CLI::App& command, const std::string& name, std::string& word,
                         const std::vector<std::string>& words, const std::string& text);
/// Several values with commas between.
template <class Value>
CLI::Option* add_list(CLI::App& command, const std::string& name, std::vector<Value>& values,
                      const std::string& text) {
  return command.add_option(name, values, text)->delimiter(',')->allow_extra_args(false);
}

/// Learners by name, or "best" and "every", between commas or blanks; others are not understood.
CLI::Option* add_learners_option(CLI::App& command, const std::string& name,
                                 std::vector<std::string>& learners, const std::string& text);
/// One of them.
CLI::Option* add_learner_option(CLI::App& command, const std::string& name, std::string& learner,
                                const std::string& text);
/// The words after "weft" with the learners that follow --learner joined by commas: nothing else
/// ends the list of names before that of the data set.
std::vector<std::string> join_learners(const std::vector<std::string>& words);

/// Names between commas: "a,b". A name that has commas itself stands in quotes ("g0, left",g1), in
/// which two quotes are one. Nothing where a quote has no end.
std::optional<std::vector<std::string>> split_names(std::string_view list);

/// An option of such a list.
CLI::Option* add_name_list(CLI::App& command, const std::string& name,
                           std::vector<std::string>& names, const std::string& text);

// Options of `weft evaluate`, `train`, `features` and `design repetitions`: the kind of the data is
// known only when the file is looked at, and no option that was typed may go without effect.

/// Kinds of data, those of sound and vibration by how they are split. One bit each.
enum class DataKind : unsigned {
  slides = 1,          ///< over a tactile array
  imprints = 2,        ///< static ones
  parts = 4,           ///< of recordings, contiguous
  random_windows = 8,  ///< of recordings
  whole_recordings = 16
};

/// "slides over a tactile array".
std::string_view describe_kind(DataKind kind);

/// Options that were typed, by their names in the commands of all kinds, and as they were typed.
using GivenOptions = std::map<std::string, std::string>;

/// The modality whose data a command accepts; empty: any, and the file decides.
using CommandModality = std::optional<classifier::Modality>;

/// What an option of the commands of all kinds is called in those of a modality.
std::string name_in(CommandModality modality, std::string_view option);

/// Where the options of a learning command are declared: `weft fabric evaluate` has those alone
/// that say something about slides, `weft evaluate` those of all kinds of data.
class LearningOptions {
 public:
  /// All of them outlive the parsing.
  LearningOptions(CLI::App& command, CommandModality modality, GivenOptions& given)
      : command_(&command), modality_(modality), given_(&given) {}

  /// The command; a discarded one where the option is not of the modality.
  [[nodiscard]] CLI::App& place_of(std::string_view option);
  /// name_in() its modality.
  [[nodiscard]] std::string name_of(std::string_view option) const {
    return name_in(modality_, option);
  }
  [[nodiscard]] CommandModality modality() const { return modality_; }
  /// Once all are declared: takes away what says nothing about the modality's data, notes what is
  /// typed, and leaves to --help-all what is rarely needed.
  void finish();

 private:
  CLI::App* command_;
  CommandModality modality_;
  GivenOptions* given_;
  CLI::App others_;
};

/// Errors: invalid_argument, one for all options that say nothing about this kind (where: their
/// names), with what to take for them where there is something. An option that nothing is known of
/// is refused for every kind.
Status check_given(const GivenOptions& given, DataKind kind);

}  // namespace weft::daemon::cli
