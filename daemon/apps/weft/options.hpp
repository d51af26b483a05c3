#pragma once
// How commands declare options, and which options say anything about which kind of data. For .cpp
// files: it brings CLI11.

#include <CLI/CLI.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

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

/// Options that were typed, by their first long name.
using GivenOptions = std::set<std::string>;

/// Has every option that `command` has by now note its name in `given` when it is typed. `given`
/// must stay where it is.
void record_given(CLI::App& command, GivenOptions& given);

/// Errors: invalid_argument, one for all options that say nothing about this kind (where: their
/// names), with what to take for them where there is something. An option that nothing is known of
/// is refused for every kind.
Status check_given(const GivenOptions& given, DataKind kind);

}  // namespace weft::daemon::cli
