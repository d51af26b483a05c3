#pragma once
// Declaring options of commands, and which options apply to which kind of data. For .cpp files
// only: it includes CLI11.

#include <CLI/CLI.hpp>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/model/model_file.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon::cli {

/// CLI::Range of a number, but it refuses "nan" too, which is neither below nor above a limit.
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
/// One of several words.
CLI::Option* add_keyword(CLI::App& command, const std::string& name, std::string& word,
                         const std::vector<std::string>& words, const std::string& text);
/// Several values separated by commas.
template <class Value>
CLI::Option* add_list(CLI::App& command, const std::string& name, std::vector<Value>& values,
                      const std::string& text) {
  return command.add_option(name, values, text)->delimiter(',')->allow_extra_args(false);
}

/// Learners by name, or "best" and "every", separated by commas or blanks; refuses other words.
CLI::Option* add_learners_option(CLI::App& command, const std::string& name,
                                 std::vector<std::string>& learners, const std::string& text);
/// A single learner.
CLI::Option* add_learner_option(CLI::App& command, const std::string& name, std::string& learner,
                                const std::string& text);
/// The words after "weft", with the learners after --learner joined by commas. Otherwise the name
/// of the data set would be read as another learner.
std::vector<std::string> join_learners(const std::vector<std::string>& words);

/// Names separated by commas: "a,b". A name with commas is quoted ("g0, left",g1); inside, two
/// quotes mean one. Empty if a quote is not closed.
std::optional<std::vector<std::string>> split_names(std::string_view list);

/// An option with such a list.
CLI::Option* add_name_list(CLI::App& command, const std::string& name,
                           std::vector<std::string>& names, const std::string& text);

// Options of `weft evaluate`, `train`, `features` and `design repetitions`. The kind of the data is
// known only when the file is read, and a typed option without effect must be refused.

/// Kinds of data; recordings of sound and vibration by their split. One bit each.
enum class DataKind : unsigned {
  slides = 1,          ///< over a tactile array
  imprints = 2,        ///< static imprints
  parts = 4,           ///< of recordings, contiguous
  random_windows = 8,  ///< of recordings
  whole_recordings = 16
};

/// "strokes of a tactile array".
std::string_view describe_kind(DataKind kind);

/// Typed options: name in the commands of all kinds, and name as typed.
using GivenOptions = std::map<std::string, std::string>;

/// The modality of data that a command accepts; empty: any, decided by the file.
using CommandModality = std::optional<classifier::Modality>;

/// Name in a modality of an option of the commands of all kinds.
std::string name_in(CommandModality modality, std::string_view option);

/// Declares the options of a learning command. `weft fabric evaluate` has only those that apply to
/// slides; `weft evaluate` has those of all kinds of data.
class LearningOptions {
 public:
  /// All arguments must outlive the parsing.
  LearningOptions(CLI::App& command, CommandModality modality, GivenOptions& given)
      : command_(&command), modality_(modality), given_(&given) {}

  /// The command, or a discarded one if the option does not apply to the modality.
  [[nodiscard]] CLI::App& place_of(std::string_view option);
  /// name_in() its modality.
  [[nodiscard]] std::string name_of(std::string_view option) const {
    return name_in(modality_, option);
  }
  [[nodiscard]] CommandModality modality() const { return modality_; }
  /// Call after the declarations. Removes options that do not apply to the modality, records the
  /// typed ones, and hides the rarely needed ones from --help.
  void finish();

 private:
  CLI::App* command_;
  CommandModality modality_;
  GivenOptions* given_;
  CLI::App others_;
};

/// Errors: invalid_argument, one for all options that do not apply to this kind (where: their
/// names), with the options to use instead, if any. An unlisted option is refused for every kind.
Status check_given(const GivenOptions& given, DataKind kind);

}  // namespace weft::daemon::cli
