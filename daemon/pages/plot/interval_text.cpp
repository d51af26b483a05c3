#include "daemon/pages/plot/interval_text.hpp"

#include "daemon/base/text/format.hpp"

namespace weft::daemon {
namespace {

namespace vibro = classifier::vibro;

void name_left_out(classifier::Interval& interval, const std::string& what) {
  if (!interval.method.starts_with("Student")) return;
  const std::size_t widened = interval.method.find(classifier::widened_to);
  interval.method = "Student t with the Nadeau-Bengio variance, over the " + what + " left out" +
                    (widened == std::string::npos ? "" : interval.method.substr(widened));
}

}  // namespace

void name_groups_left_out(classifier::Interval& interval) {
  name_left_out(interval, "groups");
}

void name_groups_left_out(classifier::Evaluation& evaluation) {
  name_groups_left_out(evaluation.ci95);
  if (!evaluation.calibration) return;
  for (classifier::BinCheck& bin : evaluation.calibration->bins)
    name_groups_left_out(bin.observed_ci95);
}

void name_left_out(vibro::CrossValidation& assessment, vibro::Protocol protocol) {
  if (protocol == vibro::Protocol::random) return;
  const bool groups = protocol == vibro::Protocol::groups;
  for (classifier::Interval* one :
       {&assessment.accuracy_ci95, &assessment.f_score_ci95, &assessment.voted_ci95})
    name_left_out(*one, groups ? "groups" : "contiguous parts of each recording");
}

std::string format_too_short(const std::vector<classifier::vibro::TooShort>& recordings,
                             std::size_t parts) {
  std::vector<std::string> names;
  for (const classifier::vibro::TooShort& one : recordings)
    names.push_back(one.file + " (" + one.label + ")");
  const bool one = names.size() == 1;
  return std::to_string(names.size()) + (one ? " recording is" : " recordings are") + " skipped, " +
         (parts > 1 ? "with a block shorter than a window (" + std::to_string(parts) +
                          " blocks; use fewer --blocks)"
                    : std::string("shorter than a window")) +
         ": " + joined(names);
}

}  // namespace weft::daemon
