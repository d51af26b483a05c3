#include "daemon/storage/dataset/dataset.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <unordered_set>

namespace weft::daemon {
namespace {

constexpr std::array<std::string_view, 7> outcome_names{
    "complete", "stopped", "aborted", "failed", "interrupted", "rejected", "ended_early"};

template <class Enum, std::size_t count>
std::optional<Enum> read_name(const std::array<std::string_view, count>& words,
                              std::string_view word) {
  const auto* at = std::ranges::find(words, word);
  if (at == words.end()) return std::nullopt;
  return static_cast<Enum>(at - words.begin());
}

Status sizes_disagree(std::string_view what, std::size_t expected, std::size_t got) {
  return fail({.code = Errc::invalid_argument,
               .what = "number of " + std::string(what) + " disagrees",
               .expected = std::to_string(expected),
               .got = std::to_string(got)});
}

Status check_taxels(const classifier::Trial& trial) {
  if (trial.taxels == 0)
    return fail({.code = Errc::invalid_argument, .what = "a trial without taxels"});
  if (trial.samples() == 0)
    return fail({.code = Errc::invalid_argument, .what = "a trial without samples"});
  if (trial.counts.size() != trial.samples() * trial.taxels)
    return sizes_disagree("counts", trial.samples() * trial.taxels, trial.counts.size());
  const auto odd = std::ranges::find_if(trial.counts, [](double c) { return !std::isfinite(c); });
  if (odd != trial.counts.end())
    return fail(
        {.code = Errc::invalid_argument,
         .where = "sample " + std::to_string(static_cast<std::size_t>(odd - trial.counts.begin()) /
                                             trial.taxels),
         .what = "a count that is not a finite number"});
  const auto phase = std::ranges::find_if(
      trial.phase, [](Phase p) { return !phase_from_char(to_char(p)).has_value(); });
  if (phase != trial.phase.end())
    return fail({.code = Errc::invalid_argument,
                 .where = "sample " + std::to_string(phase - trial.phase.begin()),
                 .what = "a phase that is none of S, P, M, E and -"});
  return {};
}

Status check_blocks(const BlockStream& stream, const BlockFormat& format, std::size_t axes,
                    const std::string& what) {
  const std::size_t blocks = stream.blocks();
  if (stream.quanta.size() != blocks * format.readings * axes)
    return sizes_disagree("values of " + what, blocks * format.readings * axes,
                          stream.quanta.size());
  for (const std::vector<std::uint32_t>* column :
       {&stream.device_us, &stream.lost, &stream.clipped})
    if (column->size() != blocks)
      return sizes_disagree("blocks of " + what, blocks, column->size());
  if (blocks > 0 && (format.readings == 0 || !(format.rate_hz > 0)))
    return fail({.code = Errc::invalid_argument,
                 .what = "blocks of " + what + " without readings or rate"});
  return {};
}

Status check_record(const TrialRecord& record, std::size_t samples, const DatasetInfo& info) {
  const std::size_t axes = info.axes.size();
  const TrialQuality& quality = record.quality;
  if (!std::isfinite(quality.force_rms_error_n.value_or(0)) ||
      !std::isfinite(quality.force_in_band_fraction.value_or(0)))
    return fail(
        {.code = Errc::invalid_argument, .what = "a quality figure that is not a finite number"});
  if (record.spec.factors.size() != info.factors.size())
    return sizes_disagree("factors", info.factors.size(), record.spec.factors.size());
  if (!std::ranges::all_of(record.spec.factors, [](double x) { return std::isfinite(x); }))
    return fail(
        {.code = Errc::invalid_argument, .what = "a factor's value that is not a finite number"});
  if (record.t_ns.size() != samples) return sizes_disagree("times", samples, record.t_ns.size());
  if (!record.device_us.empty() && record.device_us.size() != samples)
    return sizes_disagree("device times", samples, record.device_us.size());
  if (record.wrench.quanta.size() != record.wrench.samples() * 6)
    return sizes_disagree("wrench values", record.wrench.samples() * 6,
                          record.wrench.quanta.size());
  if (record.stages.quanta.size() != record.stages.samples() * axes)
    return sizes_disagree("stage positions", record.stages.samples() * axes,
                          record.stages.quanta.size());
  if (auto fine =
          check_blocks(record.acceleration, info.acceleration, acceleration_axes, "acceleration");
      !fine)
    return fine;
  return check_blocks(record.sound, info.sound, 1, "sound");
}

}  // namespace

std::string format_selection(const DatasetInfo& info) {
  std::map<std::string, std::uint64_t> by_label;
  std::uint64_t all = 0;
  for (const EndedEarly& some : info.ended_early) {
    by_label[some.label] += some.trials;
    all += some.trials;
  }
  if (all == 0) return {};
  std::string labels;
  for (const auto& [label, trials] : by_label)
    labels += (labels.empty() ? "" : ", ") + label + " " + std::to_string(trials);
  return "Selected: " + std::to_string(all) +
         (all == 1 ? " slide that a live vote ended early is"
                   : " slides that a live vote ended early are") +
         " left out (" + labels +
         "). The whole slides of these fabrics are those that the vote was "
         "unsure of, so neither a model nor an accuracy of them is one of all slides.";
}

std::string_view to_string(TrialOutcome outcome) {
  return outcome_names.at(static_cast<std::size_t>(outcome));
}

bool is_done(TrialOutcome outcome) {
  return outcome == TrialOutcome::complete || outcome == TrialOutcome::ended_early;
}

std::optional<TrialOutcome> trial_outcome_from(std::string_view word) {
  return read_name<TrialOutcome>(outcome_names, word);
}

double WrenchStream::force_n(std::size_t i, std::size_t axis) const {
  return quanta[6 * i + axis] / force_quanta_per_n;
}

double WrenchStream::torque_nm(std::size_t i, std::size_t axis) const {
  return quanta[6 * i + 3 + axis] / torque_quanta_per_nm;
}

Status check(const Dataset& dataset) {
  if (dataset.trials.empty())
    return fail({.code = Errc::invalid_argument, .what = "a data set without trials"});
  if (dataset.records.size() != dataset.trials.size())
    return sizes_disagree("records", dataset.trials.size(), dataset.records.size());
  std::unordered_set<std::string_view> files;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i) {
    const classifier::Trial& trial = dataset.trials[i];
    const std::string where = "trial " + trial.file;
    if (trial.file.empty() || !files.insert(trial.file).second)
      return fail({.code = Errc::invalid_argument,
                   .where = where,
                   .what = "the name of a trial must be present and unique"});
    if (trial.label.empty())
      return fail(
          {.code = Errc::invalid_argument, .where = where, .what = "a trial without label"});
    if (trial.taxels != dataset.trials.front().taxels)
      return fail({.code = Errc::invalid_argument,
                   .where = where,
                   .what = "trials of different taxel counts",
                   .expected = std::to_string(dataset.trials.front().taxels),
                   .got = std::to_string(trial.taxels)});
    if (auto fine = check_taxels(trial); !fine) return pass(std::move(fine).error(), where);
    auto fine = check_record(dataset.records[i], trial.samples(), dataset.info);
    if (!fine) return pass(std::move(fine).error(), where);
  }
  return {};
}

std::vector<std::string> list_explorations(const Dataset& dataset) {
  std::vector<std::string> names;
  for (const TrialRecord& record : dataset.records)
    if (record.outcome == TrialOutcome::complete &&
        std::ranges::find(names, record.spec.exploration) == names.end())
      names.push_back(record.spec.exploration);
  return names;
}

Result<std::vector<std::string>> explorations_in(std::string_view sum) {
  std::vector<std::string> out;
  for (std::size_t from = 0, to = 0; to != std::string_view::npos; from = to + 1) {
    to = sum.find('+', from);
    std::string name(sum.substr(from, to == std::string_view::npos ? to : to - from));
    if (!sum.empty() && (name.empty() || std::ranges::find(out, name) != out.end()))
      return fail({.code = Errc::invalid_argument,
                   .where = "--exploration",
                   .what = "not a sum of explorations",
                   .expected = "different names with + between them, such as M1+M2",
                   .got = std::string(sum)});
    out.push_back(std::move(name));
  }
  return out;
}

std::vector<classifier::Trial> complete_trials(const Dataset& dataset,
                                               std::optional<std::string_view> exploration) {
  std::vector<classifier::Trial> chosen;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i) {
    const TrialRecord& record = dataset.records[i];
    if (record.outcome != TrialOutcome::complete) continue;
    if (!exploration || record.spec.exploration == *exploration)
      chosen.push_back(dataset.trials[i]);
  }
  return chosen;
}

}  // namespace weft::daemon
