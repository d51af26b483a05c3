#pragma once
// The one accuracy of a campaign, the same on the terminal, in the report, on the page and over the
// API: that of the hand-over's protocol. What other protocols give stands below it, with why it is
// another figure.

#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/evaluate/splits.hpp"
#include "daemon/storage/certificate/handover_file.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

struct Headline {
  std::string exploration;
  std::string learner;     ///< "lda, ranks"
  std::string protocol;    ///< "each of 5 groups of repetitions left out in turn"
  std::size_t tested = 0;  ///< answers, each of a model that was trained without the trial
  std::string unit;        ///< what is counted: "trials", "slides", "imprints"
  HandoverShare accuracy;  ///< mean over the groups left out
  std::size_t labels = 0;
  std::vector<std::string> not_tested = {};  ///< labels that no other group has
  double base_rate = 0;  ///< share of the most frequent label: what naming it always would give
  /// Of the same answers, or of the windows they are made of; none: not known.
  std::optional<classifier::Confusion> confusion = {};
  std::string confusion_unit = {};  ///< "trials", "windows"
};

/// Rows of one group of repetitions test, all others train; a group without rows is no split.
/// `group_of`: of each repetition from 1. A row whose label no other group has tests nothing.
std::vector<classifier::Split> splits_by_repetition(const std::vector<std::uint32_t>& repetition,
                                                    const std::vector<std::size_t>& group_of);

/// One for each exploration that was handed over.
std::vector<Headline> handover_headlines(const HandoverResult& handover, const Dataset& dataset);

/// Adds what `evaluation_json`, the text of the hand-over's evaluation.json, has of confusions.
void add_confusions(std::string_view evaluation_json, std::vector<Headline>& headlines);

/// The same protocol where nothing was handed over: Learner::best, five groups of repetitions, each
/// left out in turn. An exploration without two groups that share labels has no headline. Errors:
/// the classifier's.
Result<std::vector<Headline>> measure_headlines(const Dataset& dataset, std::size_t threads = 0);

/// "M1: 98.2 % (95 %: 96.0 to 99.2) of 340 trials, lda; each of ...; ..."
std::string headline_text(const Headline& headline);
/// {exploration, learner, protocol, accuracy, ci95, tested, unit, labels, base_rate, chance}.
nlohmann::ordered_json headline_json(const Headline& headline);

/// A figure of the report that is not the headline, and why it is another.
struct OtherProtocol {
  std::string_view name;  ///< key of report.json that has its figures
  std::string_view text;  ///< one sentence
};
/// Those that a report has.
std::vector<OtherProtocol> other_protocols(bool random_splits, bool learning_curve);

}  // namespace weft::daemon
