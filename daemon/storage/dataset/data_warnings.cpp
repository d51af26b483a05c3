#include "daemon/storage/dataset/data_warnings.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>

#include "daemon/base/text/format.hpp"

namespace weft::daemon {
namespace {

using classifier::AtLimit;
using classifier::SignalState;

constexpr std::size_t most_named = 5;  // recordings per sentence, and sentences per text
constexpr const char* clock_advice = ": possibly a clock or a counter; leave the column out";
constexpr double away_from_rest = 0.1;  // as a share of the range

/// "1, 3 to 5 and 9": consecutive numbers are joined.
std::string format_names(const std::vector<std::string>& names) {
  const auto number = [](const std::string& name) {
    const bool digits = name.find_first_not_of("0123456789") == std::string::npos;
    return digits && !name.empty() && name.size() < 9 ? std::stoi(name) : -1;
  };
  std::vector<std::string> parts;
  for (std::size_t i = 0, j = 0; i < names.size(); i = j) {
    for (j = i + 1; j < names.size() && number(names[j - 1]) >= 0 &&
                    number(names[j]) == number(names[j - 1]) + 1;)
      ++j;
    parts.push_back(names[i] + (j - i > 2   ? " to " + names[j - 1]
                                : j - i > 1 ? ", " + names[j - 1]
                                            : ""));
  }
  return joined(parts);
}

std::string format_recordings(const std::vector<std::size_t>& which,
                              std::span<const std::string> names, std::string_view recording) {
  if (which.size() == names.size())
    return "all " + std::to_string(names.size()) + " " + std::string(recording) + "s";
  std::vector<std::string> named;
  for (std::size_t i = 0; i < std::min(which.size(), most_named); ++i)
    named.push_back(names[which[i]]);
  return std::to_string(which.size()) + " of " + std::to_string(names.size()) + " " +
         std::string(recording) + "s (" + joined(named) +
         (which.size() > most_named ? " and " + std::to_string(which.size() - most_named) + " more"
                                    : "") +
         ")";
}

/// True if a limit is the sensor's: the signal's most extreme value in all recordings, and not its
/// resting value.
bool is_saturated(const CheckedSignal& signal, std::size_t recording, AtLimit SignalState::*limit,
                  double farthest) {
  const SignalState& state = signal.states[recording];
  if (!(state.*limit).held || (state.*limit).value != farthest) return false;
  const bool lower = limit == &SignalState::low;
  const auto rest = recording < signal.rest.size() ? signal.rest[recording] : std::nullopt;
  if (!rest) return !lower;
  return std::abs(*rest - farthest) > away_from_rest * (state.high.value - state.low.value);
}

using HasFault = std::function<bool(const CheckedSignal&, std::size_t recording)>;

bool saturates(const CheckedSignal& signal, std::size_t recording) {
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const SignalState& state : signal.states) {
    low = std::min(low, state.low.value);
    high = std::max(high, state.high.value);
  }
  return is_saturated(signal, recording, &SignalState::high, high) ||
         is_saturated(signal, recording, &SignalState::low, low);
}

/// A clock must rise or fall in every recording.
template <bool SignalState::*direction>
bool is_clock(const CheckedSignal& signal, std::size_t /*recording*/) {
  return std::ranges::all_of(signal.states, direction);
}

bool has_few_digits(const CheckedSignal& signal, std::size_t recording) {
  return signal.states[recording].digits < classifier::fewest_digits;
}

std::string format_digits(const CheckedSignal& signal, std::size_t recording) {
  const SignalState& state = signal.states[recording];
  const auto left = static_cast<int>(std::max(0.0, std::floor(state.digits)));
  return ": the level of " + general(state.largest) + " uses " + std::to_string(16 - left) +
         " of 16 digits, " + std::to_string(left) + " remain for the deviation of " +
         general(state.deviation);
}

bool is_too_small(const CheckedSignal& signal, std::size_t recording) {
  const SignalState& state = signal.states[recording];
  return !state.constant && state.deviation < signal.least_deviation;
}

/// Faults with the most recordings first.
struct MostFirst {
  bool operator()(const std::vector<std::size_t>& a, const std::vector<std::size_t>& b) const {
    return a.size() != b.size() ? a.size() > b.size() : a < b;
  }
};

struct Fault {
  const char* code;
  HasFault has;
  const char* verb;   ///< after "taxel 7"
  const char* verbs;  ///< after "taxels 7, 8"
  const char* advice;
};

const std::vector<Fault>& all_faults() {
  static const std::vector<Fault> faults = {
      {"constant", [](const CheckedSignal& s, std::size_t i) { return s.states[i].constant; },
       "is constant", "are constant", ""},
      {"saturated", saturates, "is saturated", "are saturated", ""},
      {"only_rises", is_clock<&SignalState::only_rises>, "only rises", "only rise", clock_advice},
      {"only_falls", is_clock<&SignalState::only_falls>, "only falls", "only fall", clock_advice},
      {"few_digits", has_few_digits, "has few digits", "have few digits", ""},
      {"small_unit", is_too_small, "is nearly silent", "are nearly silent",
       ": power at the floor of the features in decibels; use a smaller unit"}};
  return faults;
}

}  // namespace

std::vector<Warning> describe_signals(std::span<const CheckedSignal> signals,
                                      std::span<const std::string> recordings,
                                      std::string_view signal, std::string_view recording) {
  std::vector<Warning> out;
  for (const Fault& fault : all_faults()) {
    std::map<std::vector<std::size_t>, std::vector<std::string>, MostFirst> names;
    std::map<std::vector<std::size_t>, std::string> digits;
    for (const CheckedSignal& one : signals) {
      std::vector<std::size_t> which;
      for (std::size_t i = 0; i < one.states.size(); ++i)
        if (fault.has(one, i)) which.push_back(i);
      if (which.empty()) continue;
      if (fault.code == std::string_view("few_digits"))
        digits.try_emplace(which, format_digits(one, which.front()));
      names[which].push_back(one.name);
    }
    for (const auto& [which, of_these] : names)
      out.push_back({fault.code, std::string(signal) + (of_these.size() > 1 ? "s " : " ") +
                                     format_names(of_these) + " " +
                                     (of_these.size() > 1 ? fault.verbs : fault.verb) + " in " +
                                     format_recordings(which, recordings, recording) +
                                     fault.advice + digits[which]});
  }
  return out;
}

std::vector<Warning> find_data_warnings(const Dataset& dataset, std::string_view exploration) {
  std::vector<CheckedSignal> signals;
  std::vector<std::string> names;
  std::vector<double> motion;
  for (std::size_t t = 0; t < dataset.trials.size(); ++t) {
    const classifier::Trial& trial = dataset.trials[t];
    const TrialRecord& record = dataset.records[t];
    const bool chosen = exploration.empty() || record.spec.exploration == exploration;
    if (record.outcome != TrialOutcome::complete || !chosen || trial.motion_samples() == 0)
      continue;
    signals.resize(std::max(signals.size(), trial.taxels));
    if (trial.taxels != signals.size()) continue;  // refused elsewhere
    names.push_back(trial.file);
    for (std::size_t k = 0; k < trial.taxels; ++k) {
      motion.clear();
      double sum = 0.0, rests = 0.0;
      for (std::size_t i = 0; i < trial.samples(); ++i) {
        const double v = trial.counts[i * trial.taxels + k];
        if (trial.phase[i] == Phase::motion) motion.push_back(v);
        if (trial.phase[i] == Phase::rest) sum += v, rests += 1.0;
      }
      signals[k].name = std::to_string(k + 1);
      signals[k].states.push_back(classifier::check_signal(motion));
      signals[k].rest.push_back(rests > 0.0 ? std::optional(sum / rests) : std::nullopt);
    }
  }
  std::vector<Warning> out = describe_signals(signals, names, "taxel", "trial");
  for (Warning& one : find_similar_labels(dataset.trials)) out.push_back(std::move(one));
  return out;
}

void to_json(nlohmann::json& out, const Warning& warning) {
  out = {{"code", warning.code}, {"text", warning.text}};
}

std::string warnings_text(std::span<const Warning> warnings) {
  std::string out;
  std::map<std::string_view, std::size_t> of_code;
  for (const Warning& one : warnings)
    if (++of_code[one.code] <= most_named) out += "WARNING: " + one.text + ".\n";
  for (const auto& [code, count] : of_code)
    if (count > most_named)
      out += "WARNING: " + std::to_string(count - most_named) + " more of kind " +
             std::string(code) + " (--json lists them).\n";
  return out;
}

}  // namespace weft::daemon
